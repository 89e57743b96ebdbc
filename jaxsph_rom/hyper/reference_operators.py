"""The fluid's equations on fixed points: a constant, a linear and a quadratic part."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float

from jaxsph import PairTerm, ParticleState, SPHFunctional, VerletList, WallList
from jaxsph.effects import (
    Effect,
    IsotropicViscosity,
    KickAndHold,
    LaminarViscosity,
    ParticleShifting,
    ShiftingTransport,
    WallRepulsion,
    WallTerm,
)
from jaxsph.scenes import Scene
from jaxsph.vector import Vector

# what keeps particles evenly spread has nothing to do on fixed points
_OF_PARTICLES = (ParticleShifting, ShiftingTransport, WallRepulsion)


def carried_density(pair, i, j):
    """(rho_j - rho_i) grad_i W_ij V_j"""
    return pair.gradient * (j.density - i.density)


def carried_velocity(pair, i, j):
    """(u_j - u_i) (x) grad_i W_ij V_j, row by row"""
    difference = j.velocity - i.velocity
    return Vector(a * g for a in difference for g in pair.gradient)


class CarriedGradients(Effect):
    """Gradients of the fields that the flow carries, at walls with the ghosts' values."""

    def rate_terms(self, space):
        return (
            PairTerm("carried_density", ("density",), carried_density),
            PairTerm("carried_velocity", ("velocity",), carried_velocity),
        )

    def wall_rate_terms(self, space):
        density, velocity = ("density",), ("velocity",)
        return (
            WallTerm("carried_density", density, density, carried_density),
            WallTerm("carried_velocity", velocity, velocity, carried_velocity),
        )


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
        functional: the scene's effects but for those that only keep particles evenly spread.
        points: x_G (G, n) [m].
        neighbors: list of the points.
    """

    functional: SPHFunctional
    points: Float[Array, "points dim"]
    neighbors: VerletList | WallList

    @classmethod
    def of_scene(cls, scene: Scene, points: Float[Array, "points dim"]) -> ReferenceOperators:
        """Operators of a scene; its viscosity is a parameter of `affine`.

        Raises:
            ValueError: if the box is too small for the kernel's support, or a force of the scene
                changes with time.
        """
        if any(isinstance(e, KickAndHold) for e in scene.effects):
            raise ValueError(
                "effects: KickAndHold changes with time, a constant part does not; use "
                "`ReducedModel` for this scene."
            )
        kept = tuple(
            IsotropicViscosity(e.viscosity) if isinstance(e, LaminarViscosity) else e
            for e in scene.effects
            if not isinstance(e, _OF_PARTICLES)
        )
        functional = eqx.tree_at(
            lambda f: f.effects, scene.functional(), kept, is_leaf=lambda x: isinstance(x, tuple)
        )
        points = jnp.asarray(points, scene.state.position.dtype)
        search = scene.search(ParticleState(points, points, points[:, 0]))
        return cls(functional, points, _neighbors(search, points))

    def affine(
        self, fields: Float[Array, "points fields"], viscosity: Float[Array, ""]
    ) -> Float[Array, "points fields"]:
        """Rates of (r, u) without advection, linear but for a force and moving walls."""
        functional = eqx.tree_at(
            lambda f: f.effects,
            self.functional,
            tuple(
                IsotropicViscosity(viscosity) if isinstance(e, IsotropicViscosity) else e
                for e in self.functional.effects
            ),
            is_leaf=lambda x: isinstance(x, tuple),
        )

        def rates(fields):
            found = functional(jnp.zeros((), fields.dtype), self._state(fields), self.neighbors)
            return jnp.concatenate([found.density[:, None], found.velocity], axis=1)

        value, slope = jax.jvp(rates, (self.rest,), (fields - self.rest,))
        return value + slope

    def gradients(self, fields: Float[Array, "points fields"]) -> Float[Array, "points fields dim"]:
        """grad (r, u), affine in the fields where walls move."""
        functional = eqx.tree_at(
            lambda f: f.effects,
            self.functional,
            (CarriedGradients(), *filter(_acts_on_ghosts, self.functional.effects)),
            is_leaf=lambda x: isinstance(x, tuple),
        )

        def gradients(fields):
            time = jnp.zeros((), fields.dtype)
            _, _, sums = functional.sums(time, self._state(fields), self.neighbors)
            count, dim = self.points.shape
            velocity = sums["carried_velocity"].reshape(count, dim, dim)
            found = jnp.concatenate([sums["carried_density"][:, None, :], velocity], axis=1)
            return self.neighbors.unsort(found)

        value, slope = jax.jvp(gradients, (self.rest,), (fields - self.rest,))
        return value + slope

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


@eqx.filter_jit
def _neighbors(search, points):
    return search.build(points)


def _acts_on_ghosts(effect: Effect) -> bool:
    return type(effect).ghost_fields is not Effect.ghost_fields


def mapped(function, stack: Float[Array, "points fields modes"], *arguments):
    """`function` of each mode of a stack, one after another; modes stay last."""
    found = lax.map(lambda fields: function(fields, *arguments), jnp.moveaxis(stack, -1, 0))
    return jnp.moveaxis(found, 0, -1)
