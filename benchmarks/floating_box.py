"""Heave of a floating box against linear theory in the same tank, and its draught at rest.

    python -m benchmarks.floating_box --resolutions 60 120

Two runs at each resolution: one let go above its place, whose period is half of three crossings of
that place, and one that starts in its place, whose mean over the second half of the run is its
draught. Linear theory (`benchmarks.references.heave`) is a potential flow in the tank, the same
crossings taken of its own heave. Every finished run's row is in the JSON file at once; the same
command goes on where it was cut short.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from jaxsph import run_scene
from jaxsph.cli import positive_int
from jaxsph.environment import environment
from jaxsph.scenes import floating_box
from jaxsph.scenes.floating_box import (
    GRAVITY,
    HEIGHT,
    LENGTH,
    REFERENCE_DENSITY,
    WIDTH,
    draught,
    water_level,
)
from jaxsph.schemes import SCHEMES

from .heaving import period
from .measure import format_rows, number, progress
from .references.heave import Tank
from .table import Table, command

KEY = ("scheme", "resolution", "density", "lift")
END = 2.0  # s, two periods
CELLS = 120  # along the tank, of linear theory; 0.3 percent of the period from twice as many
CROSSINGS = 4


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: a run was lost, 2: bad input."""
    return command("floating_box", __doc__, _arguments, _run, argv)


def _arguments(add) -> None:
    add("--resolutions", type=positive_int, nargs="+", default=[60, 120], metavar="N",
        help="particles along the tank (default: 60 120)")  # fmt: skip
    add("--schemes", choices=tuple(SCHEMES), nargs="+", default=["consistent"],
        help="default: consistent")  # fmt: skip
    add("--lifts", type=float, nargs="+", default=[0.04, 0.0], metavar="M",
        help="of the box at the start [m] (default: 0.04 0)")  # fmt: skip


def _run(options) -> None:
    kept = Table(options.json, KEY)
    cases = (
        {"scheme": scheme, "resolution": n, "density": 500.0, "lift": lift}
        for n in options.resolutions
        for scheme in options.schemes
        for lift in options.lifts
    )
    for case in kept.left(cases):
        kept.add(case | run(case))
    names = ("scheme", "resolution", "lift")
    found = ("period", "linear_period", "period_error_percent", "draught", "draught_error_percent")
    rows = [(*(str(r[n]) for n in names), *(number(r[n], 3) for n in found)) for r in kept.rows]
    print(format_rows((*names, "period s", "linear s", "off %", "draught m", "off %"), rows))


def run(case: dict[str, Any]) -> dict[str, Any]:
    """Period or draught, what they should be, and what the run took."""
    chosen = {name: case[name] for name in ("resolution", "density", "lift")}
    scene = floating_box(scheme=SCHEMES[case["scheme"]], end_time=END, **chosen)
    with progress(f"{case['resolution']} along the tank", scene.steps) as report:
        trajectory = run_scene(scene, progress=report, measure=None, averaged=None)
    height = np.asarray(trajectory.bodies.position[:, 0, 1])
    deep, level = draught(case["density"]), water_level(case["density"], case["lift"])
    rest = level - deep + 0.5 * HEIGHT
    row = dict.fromkeys(
        ("period", "linear_period", "period_error_percent", "draught", "draught_error_percent")
    )
    if case["lift"]:
        tank = Tank(LENGTH, level, WIDTH, deep, float(scene.walls.free.parts[0].mass),
                    REFERENCE_DENSITY, GRAVITY, CELLS)  # fmt: skip
        linear = tank.heave(trajectory.time, height[0] - rest)
        row["period"] = period(trajectory.time, height - rest, CROSSINGS)
        row["linear_period"] = period(trajectory.time, linear, CROSSINGS)
        row["period_error_percent"] = 100.0 * (row["period"] / row["linear_period"] - 1.0)
    else:
        late = trajectory.time > 0.5 * END + 1e-9
        row["draught"] = float(deep + rest - height[late].mean())
        row["draught_error_percent"] = 100.0 * (row["draught"] / deep - 1.0)
    spacing = scene.space.spacing
    return row | {
        "particles": trajectory.particles,
        "spacing": spacing,
        "sideways_in_spacings": float(np.ptp(trajectory.bodies.position[:, 0, 0]) / spacing),
        "largest_angle": float(np.abs(trajectory.bodies.angle).max()),
        "seconds": trajectory.metadata["run_seconds"],
        "steps": scene.steps,
        "environment": environment(),
    }


if __name__ == "__main__":
    raise SystemExit(main())
