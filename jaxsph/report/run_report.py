"""The page that a full run leaves: settings, errors and times, figures, versions and machine."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..history import energy_unit, read_history
from ..io import read_box, read_forces, read_overview, read_snapshot, read_walls_of
from ..plotting import depth_figure, forces_figure, history_figure, snapshot_figure
from ..plotting.style import png
from ..trajectory import Snapshot
from ..walls.parts import WHOLE
from . import page
from .film import film
from .settings import origin_rows, scene_rows

_FORCES = (
    "Force on each named body along the first axis and across it, over time; what the first tenth "
    "of the run has beyond the rest's range is cut off."
)


def write_run_report(
    path: str | os.PathLike,
    trajectory: str | os.PathLike,
    mass: float,
    results: Mapping[str, str],
    environment: Mapping[str, Mapping[str, Any]],
    command: str | None = None,
) -> Path:
    """Write the page of the run in a trajectory file, and return its path.

    Args:
        path: of the page.
        trajectory: the file, whole or cut short; it is read some snapshots at a time.
        mass: of a particle [kg].
        results: errors, times or what went wrong, as they are shown to people.
        environment: as `jaxsph.environment.environment` gives it.
        command: that made it, if one did.

    Raises:
        TrajectoryFileError: if the trajectory file cannot be read.
    """
    overview = read_overview(trajectory)
    pieces = [page.heading("Errors and times"), page.rows(results)]
    if overview.snapshots:
        history = read_history(trajectory, overview.particles, mass)
        time, snapshot = read_snapshot(trajectory)
        walls = read_walls_of(trajectory, snapshot)
        layer = ", of the middle layer" if overview.dim == 3 else ""
        pieces += [
            page.heading("The run"),
            film(trajectory),
            page.heading("Figures"),
            page.figure(
                png(snapshot_figure(time, snapshot, walls=walls, box=read_box(trajectory))),
                f"Velocity norm and pressure at the last snapshot, t = {time:g} s{layer}.",
            ),
            *(_in_space(time, snapshot) if overview.dim == 3 else ()),
            page.figure(
                png(history_figure(history, energy_unit(overview.dim))),
                "Kinetic energy of all particles, and the lowest and the highest density of one, "
                "over time.",
            ),
        ]
        bodies = {k: v for k, v in read_forces(trajectory).items() if k != WHOLE}
        if bodies:
            pieces += [page.figure(png(forces_figure(bodies)), _FORCES)]
    pieces += [page.heading("Scene and settings"), page.rows(scene_rows(overview))]
    pieces += [page.heading("How this came about"), page.rows(origin_rows(environment, command))]
    return page.write_page(path, f"jaxsph: {overview.scene}", pieces)


def _in_space(time: float, snapshot: Snapshot) -> list[str]:
    told = f"The fastest quarter of all particles, t = {time:g} s."
    return [page.figure(png(depth_figure(time, snapshot)), told)]
