"""Particles drawn as squares that touch, coloured by a field."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.figure import Figure
from scipy.spatial import cKDTree

from ..domain import Box
from .images import fit_box, with_images
from .style import FAINT, INK, SMALL, WALL

OVERLAP = 1.25  # side of a square in particle spacings; disorder would leave gaps otherwise
DIAGONAL = 8  # neighbours up to the diagonal ones
SAMPLE = 2000  # particles whose neighbour distance is looked up


def plane(name: str, position: np.ndarray) -> np.ndarray:
    """The positions as an array (N, 2) [m].

    Raises:
        ValueError: if they are not that.
    """
    position = np.asarray(position)
    if position.ndim != 2 or position.shape[1] != 2:
        raise ValueError(
            f"{name}: positions have shape {position.shape}, the figure draws (N, 2); "
            "take a slice of three-dimensional particles first"
        )
    return position


def middle_layer(position: np.ndarray, points: np.ndarray | None = None) -> np.ndarray:
    """Which particles (N, n) [m], or which other points, to draw in a plane: all of two dimensions,
    and of three those in a layer one spacing of the particles thick, in the middle of the third."""
    points = position if points is None else points
    if position.shape[1] == 2:
        return np.ones(len(points), bool)
    low, high = np.nanmin(position, axis=0), np.nanmax(position, axis=0)
    thickness = float(np.prod(high - low) / len(position)) ** (1.0 / 3.0)
    # off the middle by a quarter, so that of an odd and an even number of layers it holds one
    above = points[:, 2] - 0.5 * (low[2] + high[2]) + 0.25 * thickness
    return (above >= 0.0) & (above < thickness)


def spacing(position: np.ndarray) -> float:
    """Typical distance of neighbouring particles (N, 2) [m]; 1 where it cannot be told.

    On a square lattice the eighth neighbour is a diagonal away. Nearer ones say too little where
    particles have clumped.
    """
    position = position[np.isfinite(position).all(axis=1)]
    if len(position) <= DIAGONAL:
        return 1.0
    distance, _ = cKDTree(position).query(
        position[:: len(position) // SAMPLE + 1], k=[DIAGONAL + 1]
    )
    return float(np.median(distance)) / np.sqrt(2) or 1.0


def frame(axes: Axes, position: np.ndarray) -> None:
    """Limits round the particles (N, 2) [m], equal aspect, a thin frame."""
    axes.set_aspect("equal")
    axes.set_facecolor("white")
    axes.tick_params(which="both", colors=INK, labelsize=SMALL)
    for edge in axes.spines.values():
        edge.set(visible=True, color=INK, linewidth=0.6)
    known = position[np.isfinite(position).all(axis=1)]
    if not len(known):
        return
    margin = 0.5 * spacing(known)
    (left, bottom), (right, top) = known.min(axis=0) - margin, known.max(axis=0) + margin
    axes.set(xlim=(left, right), ylim=(bottom, top))


def draw_particles(
    axes: Axes,
    position: np.ndarray,
    value: np.ndarray,
    color_map: str,
    limits: tuple[float, float],
    box: Box | None = None,
) -> PathCollection:
    """Particles (N, 2) [m] coloured by value (N,), grey where it is not finite; of a periodic box
    up to its faces."""
    frame(axes, position)
    position, index = with_images(position, box, spacing(position))
    value = value[index]
    fit_box(axes, box)
    return axes.scatter(
        position[:, 0],
        position[:, 1],
        c=np.where(np.isfinite(value), value, np.nan),
        cmap=matplotlib.colormaps[color_map].with_extremes(bad=FAINT),
        vmin=limits[0],
        vmax=limits[1],
        marker="s",
        linewidths=0,
        plotnonfinite=True,
        rasterized=True,
    )


def draw_walls(axes: Axes, walls: np.ndarray | None) -> tuple[PathCollection, ...]:
    """Grey squares where walls have their ghosts (G, 2) [m], and the limits round them; nothing
    for None, and in three dimensions."""
    if walls is None or walls.shape[1] != 2 or not len(walls):
        return ()
    margin = 0.5 * spacing(walls)
    (left, bottom), (right, top) = walls.min(axis=0) - margin, walls.max(axis=0) + margin
    (x0, x1), (y0, y1) = axes.get_xlim(), axes.get_ylim()
    axes.set(xlim=(min(left, x0), max(right, x1)), ylim=(min(bottom, y0), max(top, y1)))
    return (grey_squares(axes, walls),)


def grey_squares(axes: Axes, places: np.ndarray) -> PathCollection:
    """Grey squares at places (G, 2) [m] of walls and bodies."""
    return axes.scatter(
        *places.T, color=WALL, marker="s", linewidths=0, rasterized=True, zorder=0.5
    )


def fit_squares(figure: Figure, drawn: Iterable[tuple[Any, ...]]) -> None:
    """Give each panel's squares the side that makes neighbours touch, once the layout is known.

    Args:
        figure: laid out by this.
        drawn: axes, the particles' squares, and others that are to be as large.
    """
    figure.draw_without_rendering()
    for axes, squares, *others in drawn:
        pixels = axes.get_window_extent().width
        extent = abs(axes.get_xlim()[1] - axes.get_xlim()[0])
        points = pixels * 72 / figure.dpi
        side = OVERLAP * spacing(np.asarray(squares.get_offsets())) * points / extent
        for each in (squares, *others):
            each.set_sizes([side**2])
