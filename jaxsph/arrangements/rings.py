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
    """Particles on rings around the middle of a box in two dimensions, out to a radius R.

    A disc of radius f dx, f the part of R / dx beyond a whole number, holds round(pi f^2) of them;
    ring k = 0, 1, ... around it holds round(2 pi (k + f + 1/2)), evenly spaced, at a radius that
    halves the area of the annulus of just that many squares of side dx. So a round surface stays
    round, where a lattice would leave steps, and the particles' squares fill the disc of radius R.

    Args:
        radius: R [m]; as many whole rings as fit into the box if none is given.
    """

    radius: float | None = None

    def positions(self, space):
        box = space.box
        if box.dim != 2:
            raise ValueError(f"Rings: for two dimensions only, got {box.dim}; use Lattice.")
        room, side = 0.5 * min(box.lengths), space.cell_volume**0.5
        if self.radius is not None and not 0.0 < self.radius <= room * (1.0 + 1e-12):
            raise ValueError(
                f"Rings: a radius of {self.radius:g} m does not fit into the box; give one above 0 "
                f"and up to {room:g} m."
            )
        size = (room if self.radius is None else self.radius) / side
        count = int(size + 1e-9)
        inside = 0.0 if self.radius is None else max(size - count, 0.0)
        areas = np.pi * np.concatenate([[0.0], (inside + np.arange(count + 1)) ** 2])
        held = np.round(np.diff(areas)).astype(int)
        edges = side * np.sqrt(np.concatenate([[0], np.cumsum(held)]) / np.pi)
        radii = np.sqrt(0.5 * (edges[1:] ** 2 + edges[:-1] ** 2))
        radii[0] = 0.0 if held[0] == 1 else radii[0]
        angles = np.concatenate([_TURN * k + 2.0 * np.pi * np.arange(n) / n
                                 for k, n in enumerate(held)])  # fmt: skip
        around = np.repeat(radii, held)[:, None]
        middle = 0.5 * (np.asarray(box.lower) + np.asarray(box.upper))
        return jnp.asarray(middle + around * np.stack([np.cos(angles), np.sin(angles)], axis=1))

    def places(self, space):
        return self.positions(space)
