"""Forces and torques on parts of the walls, from forces on particles and from pressures."""

from __future__ import annotations

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float


class Loads(NamedTuple):
    """What a fluid does to each of K parts of its walls, of a metre's depth in two dimensions.

    Args:
        force: (K, n) [N].
        torque: about the origin [N m], (K,) in two dimensions and (K, 3) in three.
    """

    force: Float[Array, "parts dim"]
    torque: Float[Array, "parts ..."]


class WallSurface(eqx.Module):
    """The walls' surface, its parts, and the particles beside it at one time.

    Args:
        points: of the surface (C, n) [m].
        areas: there (C, n) [m^(n - 1)], vectors into the wall.
        parts: which points belong to each of K parts (K, C).
        position: of the particles (N, n) [m].
        shares: of each part in the walls near each particle (K, N).
        turning: d_i u_j of the walls at the points (C, n, n) [1/s], where any turn.
    """

    points: Float[Array, "points dim"]
    areas: Float[Array, "points dim"]
    parts: Bool[Array, "parts points"]
    position: Float[Array, "particles dim"]
    shares: Float[Array, "parts particles"]
    turning: Float[Array, "points dim dim"] | None = None

    def held_off(self, force: Float[Array, "particles dim"]) -> Loads:
        """The reaction to what the walls as a whole do to each particle [N]."""
        return reaction(self.position, self.shares[:, :, None] * force[None])

    def pressed(self, pressure: Float[Array, " points"], total: Float[Array, " dim"]) -> Loads:
        """Pressures on the surface [Pa]; what they miss of the exact total [N] spread over it."""
        size = jnp.sqrt(jnp.sum(self.areas * self.areas, axis=1))
        force = pressure[:, None] * self.areas
        missed = total - jnp.sum(force, axis=0)
        force = force + (size / jnp.sum(size))[:, None] * missed[None, :]
        return self._on_points(force)

    def turned(self, viscosity: Float[Array, ""]) -> Loads | None:
        """-mu (d_i u_j) A_j of walls that turn, mu [Pa s]: what a viscosity that knows the gradient
        of each component by itself leaves out of the force on them."""
        if self.turning is None:
            return None
        force = jnp.einsum("cij,cj->ci", self.turning, self.areas)
        return self._on_points(-viscosity * force)

    def _on_points(self, force: Float[Array, "points dim"]) -> Loads:
        return reaction(self.points, jnp.where(self.parts[:, :, None], -force[None], 0.0))


def reaction(
    position: Float[Array, "points dim"], force: Float[Array, "parts points dim"]
) -> Loads:
    """The opposite of forces at points, added up for each part."""
    torque = torques(position[None], force)
    return Loads(-jnp.sum(force, axis=1), -jnp.sum(torque, axis=1))


def torques(arm: Float[Array, "... dim"], force: Float[Array, "... dim"]) -> Float[Array, "..."]:
    """x cross f, a number for each in two dimensions and (..., 3) in three."""
    found = moment(jnp.moveaxis(arm, -1, 0), jnp.moveaxis(force, -1, 0))
    return found[0] if len(found) == 1 else jnp.stack(found, axis=-1)


def moment(arm, force) -> tuple[Array, ...]:
    """x cross f, component by component: one in two dimensions, three in three."""
    if len(arm) == 2:
        return (arm[0] * force[1] - arm[1] * force[0],)
    return tuple(
        arm[(k + 1) % 3] * force[(k + 2) % 3] - arm[(k + 2) % 3] * force[(k + 1) % 3]
        for k in range(3)
    )
