"""Concentric rings, for round bodies of fluid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import jax.numpy as jnp
import numpy as np

from .base import Arrangement

_TURN = 2.399963229728653  # rad, the golden angle: no two rings are in step


@final
@dataclass(frozen=True)
class Rings(Arrangement):
    """Particles on rings around the middle of a box in two dimensions, out to its nearest face.

    Ring k = 0, 1, ... holds round(2 pi (k + 1/2)) particles, evenly spaced, at a radius that halves
    the area of the annulus of just that many squares of side dx: a round surface stays round, where
    a lattice would leave steps.
    """

    def positions(self, space):
        box = space.box
        if box.dim != 2:
            raise ValueError(f"Rings: for two dimensions only, got {box.dim}; use Lattice.")
        count = int(0.5 * min(box.lengths) / space.spacing)
        held = np.round(2.0 * np.pi * (np.arange(count) + 0.5)).astype(int)
        edges = space.spacing * np.sqrt(np.concatenate([[0], np.cumsum(held)]) / np.pi)
        radii = np.sqrt(0.5 * (edges[1:] ** 2 + edges[:-1] ** 2))
        angles = np.concatenate([_TURN * k + 2.0 * np.pi * np.arange(n) / n
                                 for k, n in enumerate(held)])  # fmt: skip
        around = np.repeat(radii, held)[:, None]
        middle = 0.5 * (np.asarray(box.lower) + np.asarray(box.upper))
        return jnp.asarray(middle + around * np.stack([np.cos(angles), np.sin(angles)], axis=1))

    def places(self, space):
        return self.positions(space)
