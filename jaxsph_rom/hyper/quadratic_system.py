"""The Galerkin system on reference points as constant tensors."""

from __future__ import annotations

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from jaxsph.scenes import Scene

from ..basis import Basis
from .reference_operators import ReferenceOperators, mapped


class QuadraticSystem(eqx.Module):
    """da/dt = C + nu C' + (L + nu L') a + Q(a, a), the Galerkin system with explicit viscosity.

    One system serves every Reynolds number; its cost does not depend on the number of particles.

    Args:
        constant: (C, C'); from a centre that does not rest, forces and moving walls.
        linear: (L, L').
        quadratic: Q_kij, symmetric in i and j.
    """

    constant: Float[Array, "2 modes"]
    linear: Float[Array, "2 modes modes"]
    quadratic: Float[Array, "modes modes modes"]

    @property
    def size(self) -> int:
        return self.constant.shape[1]

    def __call__(
        self, coordinates: Float[Array, " modes"], viscosity: Float[Array, ""]
    ) -> Float[Array, " modes"]:
        """da/dt, as one matrix times products of coordinates: fast alone and under `vmap`."""
        size = self.size
        ahead = jnp.concatenate([jnp.ones_like(coordinates[:1]), coordinates])
        products = (ahead[:, None] * coordinates[None, :]).reshape(-1)
        table = jnp.concatenate(
            [
                self.constant[1][:, None],
                self.linear[1],
                self.linear[0],
                self.quadratic.reshape(size, size * size),
            ],
            axis=1,
        )
        return self.constant[0] + table @ jnp.concatenate([viscosity * ahead, products])

    def truncated(self, modes: int) -> QuadraticSystem:
        """The system of the first modes."""
        return QuadraticSystem(
            self.constant[:, :modes],
            self.linear[:, :modes, :modes],
            self.quadratic[:modes, :modes, :modes],
        )


def advective(carried: Float[Array, "carrier test carried"]) -> Array:
    """u . grad w as it stands."""
    return carried


def skew_symmetric(carried: Float[Array, "carrier test carried"]) -> Array:
    """u . grad w + (div u) w / 2, tested with v:

        (<v, u . grad w> - <w, u . grad v>) / 2.

    It moves energy between modes and makes none, whatever the divergence left in the discrete u.
    Here w is the fluctuation about rest: (div u) w / 2 of a uniform density would change the speed
    of sound.
    """
    return 0.5 * (carried - jnp.swapaxes(carried, 1, 2))


def galerkin_system(
    scene: Scene,
    basis: Basis,
    points: Float[np.ndarray, "points dim"],
    form: Callable[[Array], Array] = skew_symmetric,
) -> QuadraticSystem:
    """The Galerkin system of a scene on the reference points, in the basis' inner product.

        da/dt = Phi^T W f(centre + Phi a)

    Advection takes the centre's distance from rest as one more mode, of coordinate 1, so that its
    form is that of the whole fluctuation about rest, whatever the centre.

    Args:
        scene: its effects and walls; the viscosity stays a parameter.
        basis: modes of (r, u), r the logarithmic density, orthonormal in its product.
        points: x_G, where the modes live (G, n) [m].
        form: of advection by modes, `skew_symmetric` or `advective`.
    """
    operators = ReferenceOperators.of_scene(scene, points)
    dtype = operators.points.dtype
    modes = jnp.asarray(basis.modes, dtype)
    centre = jnp.broadcast_to(jnp.asarray(basis.centre, dtype), modes.shape[:2])
    return _assembled(operators, modes, centre, jnp.asarray(basis.weights, dtype), form)


@eqx.filter_jit
def _assembled(operators, modes, centre, weights, form) -> QuadraticSystem:
    rest = operators.rest
    functions = jnp.concatenate([(centre - rest)[:, :, None], modes], axis=2)
    weighted = functions * weights[None, :, None]

    def tested(fields):
        return jnp.einsum("gfk,gf...->k...", weighted, fields)

    def slopes(function, stack, *arguments):
        def along(mode):
            return jax.jvp(lambda f: function(f, *arguments), (centre,), (mode,))[1]

        return mapped(along, stack)

    inviscid, viscous = (
        (
            tested(operators.affine(centre, nu))[1:],
            tested(slopes(operators.affine, modes, nu))[1:],
        )
        for nu in (jnp.zeros((), modes.dtype), jnp.ones((), modes.dtype))
    )
    velocity = jnp.moveaxis(functions[:, 1:], 2, 0)
    gradient = slopes(operators.gradients, functions)

    def carried(gradient):  # tested, by each velocity in turn
        return lax.map(lambda one: -tested(jnp.einsum("gd,gfd...->gf...", one, gradient)), velocity)

    by_walls = carried(operators.gradients(rest))[:, 1:]  # [i, k]: moving walls' part, by mode i
    advection = form(carried(gradient))  # [i, k, j]: function j carried by function i
    by_centre, of_centre, by_modes = advection[0, 1:], advection[1:, 1:, 0], advection[1:, 1:, 1:]
    constant = inviscid[0] + by_centre[:, 0] + by_walls[0]
    linear = inviscid[1] + by_centre[:, 1:] + (of_centre + by_walls[1:]).T
    return QuadraticSystem(
        jnp.stack([constant, viscous[0] - inviscid[0]]),
        jnp.stack([linear, viscous[1] - inviscid[1]]),
        0.5 * (jnp.transpose(by_modes, (1, 0, 2)) + jnp.transpose(by_modes, (1, 2, 0))),
    )
