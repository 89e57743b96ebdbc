"""The square or cubic lattice."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import jax.numpy as jnp
import numpy as np

from .base import Arrangement


@final
@dataclass(frozen=True)
class Lattice(Arrangement):
    """Particles at the centres of equal squares or cubes of side dx.

    Where dx does not divide a side of the box, they are as much longer or shorter as a whole number
    of them needs (`Space.steps`).
    """

    def positions(self, space):
        cells = zip(space.box.lower, space.steps, space.counts, strict=True)
        axes = [lower + (np.arange(count) + 0.5) * step for lower, step, count in cells]
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        return jnp.asarray(grid.reshape(-1, space.box.dim))
