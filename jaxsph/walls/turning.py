"""Parts of walls that turn along themselves, as rigid bodies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

_RIGID = 1e-3  # of a part's speed: what a turn may leave of its velocities


@final
class Turning(eqx.Module):
    """The gradient of the velocity of walls that turn, d_i u_j at points of their surface.

    Args:
        fit: weights (K, n, G) by which velocities of G ghosts make that of each of K parts.
        part: which points (K, C) are of each.
    """

    fit: Float[Array, "parts dim ghosts"]
    part: Float[Array, "parts points"]

    @classmethod
    def of(
        cls, place: np.ndarray, velocity: np.ndarray, held: np.ndarray, points: np.ndarray
    ) -> Turning | None:
        """Of the parts whose velocities are those of a turn, a point being of the last of them that
        has it; None if none turns.

        Args:
            place: on the wall of each ghost (G, n) [m].
            velocity: of the wall there (G, n) [m/s].
            held: which ghosts are of each part (K, G), all walls first.
            points: which points of the surface are (K, C).
        """
        if not velocity.any():
            return None
        fits, taken, left = [], [], np.ones(points.shape[1], bool)
        for own, there in zip(held[::-1], points[::-1], strict=True):
            fit = _turn(place[own], velocity[own])
            if fit is None:
                continue
            fits.append(np.zeros((place.shape[1], len(place))))
            fits[-1][:, own] = fit
            taken.append(there & left)
            left &= ~there
        if not fits:
            return None
        dtype = velocity.dtype
        return cls(jnp.asarray(np.stack(fits), dtype), jnp.asarray(np.stack(taken), dtype))

    def gradient(self, velocity: Float[Array, "ghosts dim"]) -> Float[Array, "points dim dim"]:
        """d_i u_j [1/s] at each point, zero where nothing turns."""
        each = jnp.einsum("kig,gj->kij", self.fit, velocity)
        return jnp.einsum("kc,kij->cij", self.part, each)


def alike(turnings: Sequence[Turning | None]) -> list[Turning | None]:
    """The same, each with as many parts as the one with most, zeros for those that do not turn; of
    the same walls."""
    some = [each for each in turnings if each is not None]
    if not some:
        return list(turnings)
    rows = max(len(each.fit) for each in some)

    def padded(leaf):
        return np.concatenate([leaf, np.zeros((rows - len(leaf), *leaf.shape[1:]), leaf.dtype)])

    none = jax.tree.map(lambda leaf: np.zeros_like(leaf[:0]), some[0])
    return [jax.tree.map(padded, each or none) for each in turnings]


def _turn(place: np.ndarray, velocity: np.ndarray) -> np.ndarray | None:
    """Weights (n, G) of the gradient of a turn; None if the velocities are not those of one."""
    place, velocity = np.float64(place), np.float64(velocity)
    design = np.concatenate([np.ones((len(place), 1)), place - place.mean(axis=0)], axis=1)
    weights = np.linalg.pinv(design)
    fitted = weights @ velocity
    gradient, speed = fitted[1:], np.abs(velocity).max()
    size = np.abs(gradient).max() * np.ptp(place, axis=0).max()
    apart = np.abs(velocity - design @ fitted).max()
    lopsided = np.abs(gradient + gradient.T).max() * np.ptp(place, axis=0).max()
    if size <= _RIGID * speed or max(apart, lopsided) > _RIGID * speed:
        return None
    return weights[1:]
