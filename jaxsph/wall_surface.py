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
    """

    points: Float[Array, "points dim"]
    areas: Float[Array, "points dim"]
    parts: Bool[Array, "parts points"]
    position: Float[Array, "particles dim"]
    shares: Float[Array, "parts particles"]

    def held_off(self, force: Float[Array, "particles dim"]) -> Loads:
        """The reaction to what the walls as a whole do to each particle [N]."""
        return reaction(self.position, self.shares[:, :, None] * force[None])

    def pressed(self, pressure: Float[Array, " points"], total: Float[Array, " dim"]) -> Loads:
        """Pressures on the surface [Pa]; what they miss of the exact total [N] spread over it."""
        size = jnp.sqrt(jnp.sum(self.areas * self.areas, axis=1))
        force = pressure[:, None] * self.areas
        missed = total - jnp.sum(force, axis=0)
        force = force + (size / jnp.sum(size))[:, None] * missed[None, :]
        on_parts = jnp.where(self.parts[:, :, None], -force[None], 0.0)
        return reaction(self.points, on_parts)


def reaction(
    position: Float[Array, "points dim"], force: Float[Array, "parts points dim"]
) -> Loads:
    """The opposite of forces at points, added up for each part."""
    along = position[None]
    if position.shape[1] == 2:
        torque = along[..., 0] * force[..., 1] - along[..., 1] * force[..., 0]
    else:
        torque = jnp.cross(along, force)
    return Loads(-jnp.sum(force, axis=1), -jnp.sum(torque, axis=1))
