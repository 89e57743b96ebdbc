"""The fluid's equations on fixed points: a constant, a linear and a quadratic part."""

from __future__ import annotations

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsph import PairTerm, ParticleState, Same, SPHFunctional, VerletList, WallList
from jaxsph.compiled import full_precision
from jaxsph.effects import Effect
from jaxsph.scenes import Scene
from jaxsph.vector import Vector

from ...field_advection import acts_on_ghosts
from .coefficients import Coefficients
from .fixed_points import check_quadratic, on_points, with_effects
from .point_lists import neighbors_at


def carried_density(pair, i, j):
    """(rho_j - rho_i) grad_i W_ij V_j"""
    return pair.gradient * (j.density - i.density)


def carried_velocity(pair, i, j):
    """(u_j - u_i) (x) grad_i W_ij V_j, row by row"""
    difference = j.velocity - i.velocity
    return Vector(a * g for a in difference for g in pair.gradient)


class CarriedGradients(Effect):
    """Gradients of the fields that the flow carries, at walls with the ghosts' values."""

    def rate_terms(self, context):
        return (
            PairTerm("carried_density", ("density",), carried_density, Same()),
            PairTerm("carried_velocity", ("velocity",), carried_velocity, Same()),
        )


class Acting(NamedTuple):
    """Rates without advection and gradients, at rest and their change along a direction."""

    rates: Float[Array, "points fields"]
    gradients: Float[Array, "points fields dim"]
    rates_along: Float[Array, "points fields"]
    gradients_along: Float[Array, "points fields dim"]


class ReferenceOperators(eqx.Module):
    """The SPH equations of a scene at fixed points x_G of constant volume V_0 = dx^n.

    In the velocity u and the logarithmic density r = rho0 (1 + ln(rho / rho0)),

        dr/dt = -rho0 div u - u . grad r + D r,
        du/dt = -(c0^2 / rho0) grad r - u . grad u + nu V u + b,

    they are quadratic without remainder. div, grad and the density diffusion D are the full model's
    pair sums, walls included; at fixed points they are linear. V is that of `IsotropicViscosity`:
    on a lattice it is more accurate than the full model's, as that one is among moving particles.
    Advection uses gradients in difference form, sum_j (f_j - f_i) grad W V_0.

    Args:
        functional: of the effects' forms on fixed points.
        points: x_G (G, n) [m].
        neighbors: list of the points.
        coefficients: what of the functional is left open: theta (K,).
    """

    functional: SPHFunctional
    points: Float[Array, "points dim"]
    neighbors: VerletList | WallList
    coefficients: Coefficients

    @classmethod
    def of_scene(
        cls,
        scene: Scene,
        points: Float[Array, "points dim"],
        coefficients: Coefficients | None = None,
    ) -> ReferenceOperators:
        """Operators of a scene.

        Args:
            scene: whose effects and walls act.
            points: x_G (G, n) [m].
            coefficients: left open; the scene's viscosity if none are given.

        Raises:
            ValueError: if the box is too small for the kernel's support, or an effect changes with
                time during the scene's run, is not linear in the velocity, or has no meaning on
                fixed points.
        """
        points = jnp.asarray(points, scene.state.position.dtype)
        functional = on_points(scene)
        neighbors = neighbors_at(functional, points)
        check_quadratic(scene, functional, points, neighbors)
        if coefficients is None:
            coefficients = Coefficients.named(functional, "viscosity")
        return cls(functional, points, neighbors, coefficients)

    @classmethod
    def of(
        cls, functional: SPHFunctional, points: Float[Array, "points dim"]
    ) -> ReferenceOperators:
        """Operators by a functional of fixed points that is known to be steady; none is open."""
        points = jnp.asarray(points, functional.mass.dtype)
        return cls(functional, points, neighbors_at(functional, points), Coefficients(()))

    def at(self, values: Float[Array, " coefficients"]) -> ReferenceOperators:
        """The operators at theta."""
        functional = self.coefficients.applied(self.functional, values)
        return ReferenceOperators(functional, self.points, self.neighbors, self.coefficients)

    @eqx.filter_jit
    @full_precision
    def along(
        self, direction: Float[Array, "points fields"], values: Float[Array, " coefficients"]
    ) -> Acting:
        """Rates of (r, u) without advection and grad (r, u), at theta: at rest and along a
        direction. One program serves all who ask, whatever the number of modes."""
        at = self.at(values)
        acting = (CarriedGradients(), *filter(acts_on_ghosts, at.functional.effects))
        carrying = with_effects(at.functional, acting)
        time = jnp.zeros((), direction.dtype)

        def rates(fields):
            found = at.functional(time, self._state(fields), self.neighbors)
            return jnp.concatenate([found.density[:, None], found.velocity], axis=1)

        def gradients(fields):
            _, _, sums = carrying.sums(time, self._state(fields), self.neighbors)
            count, dim = self.points.shape
            velocity = sums["carried_velocity"].reshape(count, dim, dim)
            found = jnp.concatenate([sums["carried_density"][:, None, :], velocity], axis=1)
            return self.neighbors.unsort(found)

        value, slope = jax.jvp(lambda f: (rates(f), gradients(f)), (self.rest,), (direction,))
        return Acting(*value, *slope)

    def affine(
        self, fields: Float[Array, "points fields"], values: Float[Array, " coefficients"]
    ) -> Float[Array, "points fields"]:
        """Rates of (r, u) at theta without advection, linear but for a force and moving walls."""
        found = self.along(fields - self.rest, values)
        return found.rates + found.rates_along

    def gradients(self, fields: Float[Array, "points fields"]) -> Float[Array, "points fields dim"]:
        """grad (r, u), affine in the fields where walls move."""
        found = self.along(fields - self.rest, self.coefficients.values(self.functional))
        return found.gradients + found.gradients_along

    @property
    def rest(self) -> Float[Array, "points fields"]:
        """(rho0, 0)."""
        count, dim = self.points.shape
        rest = jnp.zeros((count, 1 + dim), self.points.dtype)
        return rest.at[:, 0].set(self.functional.fluid.reference_density)

    @property
    def space(self):
        return self.functional.space

    def _state(self, fields) -> ParticleState:
        return ParticleState(self.points, fields[:, 1:], fields[:, 0])
