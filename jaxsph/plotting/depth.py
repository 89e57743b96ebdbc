"""Particles in space, the nearer ones before the others."""

from __future__ import annotations

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from ..trajectory import Snapshot
from .fields import VELOCITY, ParticleField
from .style import FAINT, INK, SMALL, TEXT, finite_range, sheet

MOST = 20_000  # points that are drawn
_KEPT = 0.25  # of the particles, those of the largest values: all of them hide what is inside


def depth_figure(time: float, snapshot: Snapshot, field: ParticleField = VELOCITY) -> Figure:
    """The quarter of three-dimensional particles with the largest values of a field, in magnitude.

    Args:
        time: of the snapshot [s].
        snapshot: positions (N, 3) [m] and fields.
        field: chooses the particles and colours them.

    Raises:
        ValueError: if the particles are in a plane.
    """
    snapshot = snapshot.in_flow()
    position, value = np.asarray(snapshot.position), np.asarray(field.value(snapshot))
    if position.shape[1] != 3:
        raise ValueError(
            f"snapshot: positions have shape {position.shape}; (N, 3) have a depth, draw others "
            "by snapshot_figure."
        )
    size = np.where(np.isfinite(value), np.abs(value), -1.0)
    count = min(MOST, max(1, round(_KEPT * len(value))))
    shown = np.argpartition(size, -count)[-count:]
    color_map, limits = field.colours(*(finite_range([value]) or (0.0, 1.0)))
    figure = sheet(6.4, 5.0, "none")
    axes = figure.add_axes((0.02, 0.05, 0.74, 0.9), projection="3d")
    points = axes.scatter(
        *position[shown].T,
        c=np.where(np.isfinite(value[shown]), value[shown], np.nan),
        cmap=matplotlib.colormaps[color_map].with_extremes(bad=FAINT),
        vmin=limits[0],
        vmax=limits[1],
        s=3000.0 / len(value) ** (2.0 / 3.0),
        linewidths=0,
        depthshade=True,
    )
    for name in "xyz":
        getattr(axes, f"set_{name}label")(f"{name} [m]", fontsize=TEXT, color=INK)
    low, high = np.nanmin(position, axis=0), np.nanmax(position, axis=0)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(np.maximum(high - low, 0.1 * (high - low).max()))
    axes.tick_params(labelsize=SMALL, colors=INK)
    axes.set_title(f"t = {time:.4g} s", fontsize=TEXT, color=INK)
    bar = figure.colorbar(points, cax=figure.add_axes((0.84, 0.2, 0.03, 0.6)))
    bar.set_label(field.label, fontsize=TEXT, color=INK)
    bar.ax.tick_params(labelsize=SMALL, colors=INK)
    return figure
