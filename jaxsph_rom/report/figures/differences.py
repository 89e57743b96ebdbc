"""What reduced runs get wrong, place by place."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.spatial import cKDTree

from jaxsph import Box
from jaxsph.plotting.particles import draw_particles, draw_walls, fit_squares, plane
from jaxsph.plotting.style import INK, SIGNED_MAP, SMALL, TEXT, finite_range, save, sheet

from .snapshots import PANEL, Row

_NEAREST = 13  # particles of a fit
_RIDGE = 1e-9  # of a slope that particles do not determine
_NAMES = ("velocity norm [m/s]", "pressure [Pa]")


def field_differences(
    rows: Sequence[Row],
    path: str | os.PathLike[str],
    walls: np.ndarray | None = None,
    box: Box | None = None,
) -> Path:
    """Reduced minus full, a column for each reduced run: velocity norm above, pressure below.

    The full run's values are taken to the reduced run's places by linear fits. Each panel's colours
    span its own largest difference, so that small ones are seen; what they span is at its bar.

    Args:
        rows: label, positions (N, 2) [m], velocity norm (N,) [m/s], pressure (N,) [Pa] of each
            run, the full one first.
        path: the file to write.
        walls: places of the walls' ghosts (G, 2) [m], drawn grey.
        box: of the runs; what is beyond a periodic face is drawn up to it.
    """
    if len(rows) < 2:
        raise ValueError(f"rows: got {len(rows)}; give the full run and at least one other.")
    full, *others = rows
    start = plane(full[0], full[1])
    width, height = np.ptp(start, axis=0)
    tall = PANEL * min(max(height / width, 0.3), 1.5)
    figure = sheet((PANEL + 1.3) * len(others), 2 * (tall + 0.25) + 0.7, "compressed")
    grid = figure.subplots(2, len(others), squeeze=False, sharex=True, sharey=True)
    drawn = []
    for column, (label, position, *values) in enumerate(others):
        position = plane(label, position)
        known = np.isfinite(position).all(axis=1)
        wanted = np.full((len(position), 2), np.nan)
        wanted[known] = linear_fit(position[known], start, np.stack(full[2:], axis=1))
        for line, (name, value) in enumerate(zip(_NAMES, values, strict=True)):
            axes, apart = grid[line, column], np.asarray(value) - wanted[:, line]
            low, high = finite_range([apart]) or (0.0, 0.0)
            most = max(-low, high) or 1.0
            squares = draw_particles(axes, position, apart, SIGNED_MAP, (-most, most), box)
            bar = figure.colorbar(squares, ax=axes, pad=0.02, aspect=16)
            bar.set_label(f"difference in {name}", fontsize=SMALL, color=INK)
            bar.ax.tick_params(labelsize=SMALL, colors=INK)
            drawn.append((axes, squares, *draw_walls(axes, walls)))
        grid[0, column].set_title(label, fontsize=TEXT, color=INK)
        grid[1, column].set_xlabel("x [m]", fontsize=TEXT, color=INK)
    for line in grid:
        line[0].set_ylabel("y [m]", fontsize=TEXT, color=INK)
    fit_squares(figure, drawn)
    return save(figure, path)


def linear_fit(
    points: Float[np.ndarray, "points dim"],
    position: Float[np.ndarray, "particles dim"],
    values: Float[np.ndarray, "particles fields"],
) -> Float[np.ndarray, "points fields"]:
    """Values at points [m] by weighted least squares of a linear function of the nearest
    particles; exact for linear fields."""
    count = min(_NEAREST, len(position))
    distance, near = cKDTree(position).query(points, k=count)
    radius = 1.1 * distance[:, -1:] + np.finfo(float).tiny
    weight = (1.0 - distance / radius) ** 2
    apart = (position[near] - points[:, None]) / radius[..., None]
    columns = np.concatenate([np.ones((*near.shape, 1)), apart], axis=2)
    weighted = weight[..., None] * columns
    matrix = np.einsum("pka,pkb->pab", weighted, columns) + _RIDGE * np.eye(columns.shape[2])
    return np.linalg.solve(matrix, np.einsum("pka,pkf->paf", weighted, values[near]))[:, 0]
