"""Fields of several runs side by side."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from jaxsph import Box
from jaxsph.plotting.particles import draw_particles, draw_walls, fit_squares, plane
from jaxsph.plotting.style import (
    INK,
    MAGNITUDE_MAP,
    SIGNED_MAP,
    SMALL,
    TEXT,
    finite_range,
    save,
    shared_limits,
    sheet,
)

BEYOND = 0.3  # ranges of the first run that the colours reach past it at most
PANEL = 2.6  # side of a square panel [inch]

Row = tuple[str, np.ndarray, np.ndarray, np.ndarray]


def field_snapshots(
    rows: Sequence[Row],
    path: str | os.PathLike[str],
    walls: np.ndarray | None = None,
    box: Box | None = None,
) -> Path:
    """Velocity norm above and pressure below, a column per run, one colour scale per quantity.

    The first run is the reference: the scale ends a third of its range beyond it, so that a run
    that blew up does not bleach the others. Particles whose value is not finite are grey.

    Args:
        rows: label, positions (N, 2) [m], velocity norm (N,) [m/s], pressure (N,) [Pa] of each.
        path: the file to write.
        walls: places of the walls' ghosts (G, 2) [m], drawn grey.
        box: of the runs; what is beyond a periodic face is drawn up to it.
    """
    if not rows:
        raise ValueError("rows: got none; give at least one run")
    positions = [plane(row[0], row[1]) for row in rows]
    width, height = np.nanmax(positions[0], axis=0) - np.nanmin(positions[0], axis=0)
    tall = PANEL * min(max(height / width, 0.3), 1.5)
    figure = sheet(PANEL * len(rows) + 1.5, 2 * (tall + 0.25) + 0.7, "compressed")
    grid = figure.subplots(2, len(rows), squeeze=False, sharex=True, sharey=True)
    figure.get_layout_engine().set(wspace=0.06, hspace=0.06)
    drawn = []
    for line, name, column in zip(
        grid, ("velocity norm [m/s]", "pressure [Pa]"), (2, 3), strict=True
    ):
        values = [np.asarray(row[column]) for row in rows]
        low, high = shared_limits(values, BEYOND)
        color_map = MAGNITUDE_MAP
        if low < 0 < high and column == 3:
            high = max(-low, high)
            low, color_map = -high, SIGNED_MAP
        for axes, row, position, value in zip(line, rows, positions, values, strict=True):
            if value.shape != position.shape[:1]:
                raise ValueError(
                    f"rows: {row[0]!r} has {name} of shape {value.shape}; "
                    f"give ({len(position)},), one value per particle"
                )
            squares = draw_particles(axes, position, value, color_map, (low, high), box)
            drawn.append((axes, squares, *draw_walls(axes, walls)))
            if column == 2:
                axes.set_title(row[0], fontsize=TEXT, color=INK)
            else:
                axes.set_xlabel("x [m]", fontsize=TEXT, color=INK)
        line[0].set_ylabel("y [m]", fontsize=TEXT, color=INK)
        found = finite_range(values) or (low, high)
        beyond = {
            (False, False): "neither",
            (True, False): "min",
            (False, True): "max",
            (True, True): "both",
        }[found[0] < low, found[1] > high]
        bar = figure.colorbar(drawn[-1][1], ax=list(line), extend=beyond, pad=0.02, aspect=16)
        bar.set_label(name, fontsize=TEXT, color=INK)
        bar.ax.tick_params(labelsize=SMALL, colors=INK)
    fit_squares(figure, drawn)
    return save(figure, path)
