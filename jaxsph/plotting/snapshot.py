"""A snapshot of a run, a panel for each field."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.figure import Figure

from ..domain import Box
from ..trajectory import Snapshot
from .fields import PRESSURE, VELOCITY, ParticleField
from .particles import draw_particles, draw_walls, fit_squares, middle_layer
from .style import INK, SMALL, TEXT, finite_range, sheet

_PANEL = 4.0  # longer side of a panel [inch]
_BAR = 1.4  # room for a colour bar and labels [inch]


def snapshot_figure(
    time: float,
    snapshot: Snapshot,
    fields: Sequence[ParticleField] = (VELOCITY, PRESSURE),
    walls: np.ndarray | None = None,
    box: Box | None = None,
) -> Figure:
    """Particles coloured by fields, side by side; of three-dimensional ones the middle layer.

    Args:
        time: of the snapshot [s].
        snapshot: positions (N, n) [m] and fields, as read from a file; parked particles are not
            drawn.
        fields: which ones to show.
        walls: places of the walls' ghosts (G, n) [m], drawn grey in two dimensions.
        box: of the run; what is beyond a periodic face is drawn up to it.
    """
    snapshot = snapshot.in_flow()
    shown = middle_layer(np.asarray(snapshot.position))
    position = np.asarray(snapshot.position)[shown, :2]
    flat = walls is not None and walls.shape[1] == 2
    width, height = panel_size(np.concatenate([position, walls]) if flat else position)
    figure = sheet(len(fields) * (width + _BAR), height + 0.8, "compressed")
    drawn = []
    for axes, field in zip(figure.subplots(1, len(fields), squeeze=False)[0], fields, strict=True):
        value = field.value(snapshot)[shown]
        color_map, limits = field.colours(*(finite_range([value]) or (0.0, 1.0)))
        squares = draw_particles(axes, position, value, color_map, limits, box)
        label_panel(figure, axes, squares, field.label)
        axes.set_title(f"t = {time:.4g} s", fontsize=TEXT, color=INK)
        drawn.append((axes, squares, *draw_walls(axes, walls)))
    fit_squares(figure, drawn)
    return figure


def panel_size(position: np.ndarray) -> tuple[float, float]:
    """Width and height [inch] of a panel for particles (N, 2) [m]."""
    extent = np.nanmax(position, axis=0) - np.nanmin(position, axis=0)
    extent = np.maximum(extent, 0.1 * extent.max() or 1.0)
    width, height = _PANEL * extent / extent.max()
    return max(width, 0.4 * _PANEL), max(height, 0.4 * _PANEL)


def label_panel(
    figure: Figure, axes: Axes, squares: PathCollection, label: str, extend: str = "neither"
) -> None:
    """Axes and colour bar with their units."""
    axes.set_xlabel("x [m]", fontsize=TEXT, color=INK)
    axes.set_ylabel("y [m]", fontsize=TEXT, color=INK)
    bar = figure.colorbar(squares, ax=axes, pad=0.02, aspect=22, extend=extend)
    bar.set_label(label, fontsize=TEXT, color=INK)
    bar.ax.tick_params(labelsize=SMALL, colors=INK)
