"""Where the walls' surface is, and how large."""

from __future__ import annotations

import numpy as np

from ..pairs import Space
from .region import Region
from .walls import distances


def surface(fluid_region: Region, space: Space) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points of the walls' surface [m], its area there [m^(n - 1)], a vector into the wall along
    one of the axes, and places in the wall behind them [m]; each (C, n).

    A = -V grad chi by central differences on the lattice, chi the share of a cell that is fluid's:
    so the areas of a closed surface add up to zero, and sum p A over one is -sum chi V grad p, to
    round-off (summation by parts).
    """
    points = space.lattice(layers=2)
    box = space.box
    counts = [
        count + (0 if periodic else 4)
        for count, periodic in zip(space.counts, box.periodic, strict=True)
    ]
    depth = -distances(fluid_region, points) / np.min(space.steps)
    share = np.clip(0.5 + depth, 0.0, 1.0).reshape(counts)
    found = []
    for axis, step in enumerate(space.steps):
        half = 0.5 * space.cell_volume / step
        along = half * (np.roll(share, 1, axis) - np.roll(share, -1, axis)).ravel()
        there = np.abs(along) > 1e-12 * half
        areas = along[there, None] * np.eye(box.dim)[axis]
        found.append((points[there], areas, points[there] + np.sign(areas) * step))
    return tuple(np.concatenate(a) for a in zip(*found, strict=True))
