"""The fluid and its equation of state."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float


class LinearEquationOfState(eqx.Module):
    """p = c0^2 (rho - rho0), the paper's equation of state for a weakly compressible fluid."""

    def pressure(self, density: Array, reference_density: Array, sound_speed: Array) -> Array:
        """Pressure [Pa] of a density [kg/m^3]."""
        return sound_speed**2 * (density - reference_density)

    def density(self, pressure: Array, reference_density: Array, sound_speed: Array) -> Array:
        """Density [kg/m^3] of a pressure [Pa]."""
        return reference_density + pressure / sound_speed**2

    def enthalpy(self, density: Array, reference_density: Array, sound_speed: Array) -> Array:
        """Integral of dp / rho [m^2/s^2] from the reference density on."""
        return sound_speed**2 * jnp.log(density / reference_density)

    def density_of_enthalpy(
        self, enthalpy: Array, reference_density: Array, sound_speed: Array
    ) -> Array:
        """Density [kg/m^3] of an enthalpy [m^2/s^2]."""
        return reference_density * jnp.exp(enthalpy / sound_speed**2)


class TaitEquationOfState(eqx.Module):
    """p = rho0 c0^2 / gamma [(rho / rho0)^gamma - 1] (Cole 1948; Monaghan 1994).

    Agrees with the linear one to first order, and resists strong compression more.

    Args:
        exponent: gamma, 7 for water (static).
    """

    exponent: float = eqx.field(static=True, default=7.0)

    def pressure(self, density: Array, reference_density: Array, sound_speed: Array) -> Array:
        """Pressure [Pa] of a density [kg/m^3]."""
        stiffness = reference_density * sound_speed**2 / self.exponent
        return stiffness * ((density / reference_density) ** self.exponent - 1.0)

    def density(self, pressure: Array, reference_density: Array, sound_speed: Array) -> Array:
        """Density [kg/m^3] of a pressure [Pa] above -rho0 c0^2 / gamma; lower ones count as that
        of half the reference density."""
        stiffness = reference_density * sound_speed**2 / self.exponent
        floor = 0.5**self.exponent
        ratio = jnp.maximum(1.0 + pressure / stiffness, floor)
        return reference_density * ratio ** (1.0 / self.exponent)

    def enthalpy(self, density: Array, reference_density: Array, sound_speed: Array) -> Array:
        """Integral of dp / rho [m^2/s^2] from the reference density on."""
        power = self.exponent - 1.0
        return sound_speed**2 / power * ((density / reference_density) ** power - 1.0)

    def density_of_enthalpy(
        self, enthalpy: Array, reference_density: Array, sound_speed: Array
    ) -> Array:
        """Density [kg/m^3] of an enthalpy [m^2/s^2]; at least half the reference density."""
        power = self.exponent - 1.0
        ratio = jnp.maximum(1.0 + enthalpy * power / sound_speed**2, 0.5**power)
        return reference_density * ratio ** (1.0 / power)


class Fluid(eqx.Module):
    """A weakly compressible fluid.

    Args:
        reference_density: rho0 [kg/m^3].
        sound_speed: c0 [m/s]; about ten times the largest speed.
        reference_speed: U, the largest speed expected [m/s]; Ma = U / c0.
        equation_of_state: gives pressure from density and back.
    """

    reference_density: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    sound_speed: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    reference_speed: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    equation_of_state: LinearEquationOfState | TaitEquationOfState = LinearEquationOfState()

    def pressure(self, density: Array) -> Array:
        """Pressure [Pa] of a density [kg/m^3] by the equation of state."""
        return self.equation_of_state.pressure(density, self.reference_density, self.sound_speed)

    def density(self, pressure: Array) -> Array:
        """Density [kg/m^3] of a pressure [Pa] by the equation of state."""
        return self.equation_of_state.density(pressure, self.reference_density, self.sound_speed)

    def enthalpy(self, density: Array) -> Array:
        """Integral of dp / rho [m^2/s^2] from the reference density on."""
        return self.equation_of_state.enthalpy(density, self.reference_density, self.sound_speed)

    def density_of_enthalpy(self, enthalpy: Array) -> Array:
        """Density [kg/m^3] of an enthalpy [m^2/s^2]."""
        return self.equation_of_state.density_of_enthalpy(
            enthalpy, self.reference_density, self.sound_speed
        )
