"""Signed distances of regions at many points, on the host, and cells of a lattice in them."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from ..pairs import Space
from .region import Region

_POINTS = 4096  # evaluated at once
_PARTS = {2: 8, 3: 4}  # of a cell's side, for cells that a surface may cut


def distances(region: Region, points: Float[np.ndarray, "points dim"]) -> np.ndarray:
    """The region's signed distance [m] at points, (P,)."""
    return _in_blocks(distance_in, region, points)


def slopes(region: Region, points: Float[np.ndarray, "points dim"]) -> np.ndarray:
    """Its gradients there, (P, n)."""
    return _in_blocks(slope_in, region, points)


def _in_blocks(function: Callable, region: Region, points: np.ndarray) -> np.ndarray:
    """`function(region, points)` on blocks of equal size, so that it is compiled once."""
    count = len(points)
    filler = points[-1:] if count else np.zeros((1, points.shape[1]))
    missing = -count % _POINTS if count else _POINTS
    padded = np.concatenate([points, np.repeat(filler, missing, axis=0)])
    blocks = padded.reshape(-1, _POINTS, points.shape[1])
    return np.concatenate([np.asarray(function(region, jnp.asarray(b))) for b in blocks])[:count]


@partial(jax.jit, static_argnums=0, inline=True)
def distance_in(region: Region, points):
    """The signed distance, as one function in whatever program it is part of."""
    return region.signed_distance(points)


@partial(jax.jit, static_argnums=0, inline=True)
def slope_in(region: Region, points):
    """Its gradient, likewise."""
    return jax.vmap(jax.grad(lambda x: region.signed_distance(x[None, :])[0]))(points)


class Cells(NamedTuple):
    """The cells of a space's lattice in a region: whole where no surface is near, in parts where
    one may cut them.

    Args:
        whole: middles (W, n) [m] of the cells within.
        parts: middles (P, n) [m] of the parts of those that may be cut.
        share: of each part that is within (P,), second-order.
        divided: in how many parts a side is.
    """

    whole: Float[np.ndarray, "cells dim"]
    parts: Float[np.ndarray, "parts dim"]
    share: Float[np.ndarray, " parts"]
    divided: int

    @classmethod
    def of(cls, region: Region, space: Space) -> Cells:
        """Those of a region within the box."""
        cells, steps = space.lattice(), np.asarray(space.steps)
        depth, parts = -distances(region, cells), _PARTS[space.box.dim]
        far = np.abs(depth) >= 0.5 * math.hypot(*space.steps)
        offset = (np.arange(parts) + 0.5) / parts - 0.5
        offsets = np.stack(np.meshgrid(*[offset] * len(steps), indexing="ij"), axis=-1)
        offsets = offsets.reshape(-1, len(steps)) * steps
        points = (cells[~far][:, None, :] + offsets[None]).reshape(-1, len(steps))
        share = np.clip(0.5 - distances(region, points) * parts / steps.min(), 0.0, 1.0)
        return cls(cells[far & (depth > 0.0)], points, share, parts)

    @property
    def count(self) -> float:
        """How many cells the region has room for."""
        return len(self.whole) + float(self.share.sum()) / self.divided ** self.whole.shape[1]
