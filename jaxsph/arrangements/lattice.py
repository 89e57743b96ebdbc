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
    """Particles at the centres of equal squares or cubes of side dx."""

    def positions(self, space):
        axes = []
        for lower, length in zip(space.box.lower, space.box.lengths, strict=True):
            count = round(length / space.spacing)
            axes.append(lower + (np.arange(count) + 0.5) * (length / count))
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        return jnp.asarray(grid.reshape(-1, space.box.dim))
