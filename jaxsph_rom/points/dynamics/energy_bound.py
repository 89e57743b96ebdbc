"""What energy a reduced flow may have."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from jaxsph import Fluid

from ...basis import Basis

_SPEEDS = 2.0  # times U; in density that is 0.2 rho0 at Mach 0.1, the full model's own bound


class EnergyBound(eqx.Module):
    """Kinetic plus acoustic energy of a reduced flow, and the most that it may be:

        e(a) = mean over points of |u|^2 + (c0 / rho0)^2 (r - rho0)^2 <= (2 U)^2,

    U the fluid's reference speed, the largest expected. Whatever the basis' own product and centre,
    e is a quadratic form of the coordinates, made once from the modes.

    Args:
        constant, linear, quadratic: of e(a) [m^2/s^2].
        limit: on e [m^2/s^2].
    """

    constant: Float[Array, ""]
    linear: Float[Array, " modes"]
    quadratic: Float[Array, "modes modes"]
    limit: Float[Array, ""]

    @classmethod
    def of(cls, basis: Basis, fluid: Fluid) -> EnergyBound:
        """The bound of flows in a basis of (r, u), r the logarithmic density."""
        modes = np.asarray(basis.modes)
        count, fields, size = modes.shape
        rest, sound, speed = (
            float(a) for a in (fluid.reference_density, fluid.sound_speed, fluid.reference_speed)
        )
        scale = np.ones(fields)
        scale[0] = sound / rest
        away = np.broadcast_to(np.asarray(basis.centre), (count, fields)).astype(float)
        away[:, 0] -= rest
        away, flat = (away * scale).reshape(-1), (modes * scale[:, None]).reshape(-1, size)
        parts = (away @ away / count, 2.0 * away @ flat / count, flat.T @ flat / count)
        return cls(*(jnp.asarray(a, modes.dtype) for a in (*parts, (_SPEEDS * speed) ** 2)))

    def energy(self, coordinates: Float[Array, " modes"]) -> Float[Array, ""]:
        """e(a) [m^2/s^2]."""
        return self.constant + coordinates @ (self.linear + self.quadratic @ coordinates)

    def exceeded(self, coordinates: Float[Array, " modes"]) -> Bool[Array, ""]:
        """Whether a flow has more energy than it may have; false for what is not finite."""
        return self.energy(coordinates) > self.limit
