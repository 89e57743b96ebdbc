"""Drag, lift, wake length and Strouhal number of the scene `cylinder` beside the literature.

    python -m benchmarks.cylinder_wake --reynolds 20 100 --resolutions 10 --widths 10

Forces are means between snapshots of every stage of every step. Steady flows (Re 20, 40): drag and
its deviation over the last quarter of the run, and the distance from the cylinder's back to where
the mean velocity on the centre line turns. Shedding ones: over the second half, a sine with its
frequency free is fitted to lift; the part of lift that it leaves is told. Literature is of a single
cylinder in an unbounded stream, the scene's is one of a row, D / width of the stream, and the
stream is uniform a finite way ahead of it: two widths and two ways show what that makes. Every
finished run's row is in the JSON file at once; the same command goes on where it was cut short.
"""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np

from jaxsph.cli import positive_float, positive_int
from jaxsph.scenes import cylinder
from jaxsph.scenes.composed import GHOSTS
from jaxsph.scenes.cylinder import DIAMETER, SPEED

from .measure import format_rows, number
from .open_flows import last_turn, mean_along, ran
from .table import Table, command
from .wake_runs import harmonic

KEY = ("reynolds", "ghosts", "ends", "resolution", "width", "upstream", "h_over_dx", "mach",
       "end_time")  # fmt: skip
LITERATURE = {  # of a single cylinder
    20: {"drag": (2.00, 2.05), "wake_length": (0.90, 0.94)},
    40: {"drag": (1.50, 1.55), "wake_length": (2.1, 2.3)},
    100: {"drag": (1.33, 1.37), "strouhal": (0.164, 0.166), "lift_amplitude": (0.32, 0.34)},
    200: {"strouhal": (0.195, 0.197)},
}
SHEDS = 47.0  # the Reynolds number above which a wake sheds vortices
END_TIME = {False: 40.0, True: 100.0}  # s, whether it does
SHORTEST = 6.0  # s: a period of lift in half of it, at some ten snapshots
BEHIND = 4.0  # m of centre line that is looked at


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: a run failed, 2: bad input."""
    return command("cylinder_wake", __doc__, _arguments, _run, argv)


def _arguments(add) -> None:
    add("--reynolds", type=positive_float, nargs="+", default=[20.0, 40.0, 100.0, 200.0],
        metavar="RE", help="default: 20 40 100 200")  # fmt: skip
    add("--ghosts", choices=GHOSTS, default="lattice", help="of the cylinder (default: lattice)")
    add("--ends", choices=("fringe", "openings"), default="fringe", help="default: fringe")
    add("--resolutions", type=positive_int, nargs="+", default=[10], metavar="N",
        help="particles a diameter (default: 10)")  # fmt: skip
    add("--widths", type=positive_float, nargs="+", default=[10.0], metavar="W",
        help="from cylinder to cylinder [m] (default: 10)")  # fmt: skip
    add("--upstream", type=positive_float, nargs="+", default=[5.0], metavar="X",
        help="of stream ahead of the cylinder [m] (default: 5)")  # fmt: skip
    add("--h-over-dx", type=positive_float, default=1.5, metavar="X", help="default: 1.5")
    add("--mach", type=positive_float, default=0.1, metavar="M", help="default: 0.1")
    add("--t-end", type=positive_float, metavar="T",
        help="default: 40 s where the wake is steady, 100 s where it sheds")  # fmt: skip


def _run(options) -> bool:
    kept = Table(options.json, KEY, beside=lambda rows: {"literature": LITERATURE})
    cases = []
    domains = product(options.resolutions, options.widths, options.upstream)
    for (n, width, ahead), re in product(domains, options.reynolds):
        end = options.t_end or END_TIME[re > SHEDS]
        if re > SHEDS and end < SHORTEST:
            raise ValueError(f"--t-end: at least {SHORTEST:g} s, or lift cannot be seen to swing.")
        walls, fluid = (options.ghosts, options.ends), (options.h_over_dx, options.mach)
        cases.append(dict(zip(KEY, (re, *walls, n, width, ahead, *fluid, end), strict=True)))
    for case in kept.left(cases):
        kept.add(case | run(case))
    print(_table(kept.rows))
    return any(row["fault"] for row in kept.rows)


def run(case: dict[str, Any]) -> dict[str, Any]:
    """A run's coefficients, and what they took."""
    reynolds, resolution = case["reynolds"], case["resolution"]
    others = {name: case[name] for name in KEY if name not in ("reynolds", "resolution")}
    scene = cylinder(resolution, reynolds, **others)
    trajectory, row = ran(scene, f"Re {reynolds:g}, {resolution} a diameter")
    if row["fault"]:
        return row
    coefficients = 2.0 * trajectory.mean_forces["cylinder"] / (SPEED**2 * DIAMETER)
    measured = shedding if reynolds > SHEDS else steady
    return row | measured(scene, trajectory, coefficients)


def shedding(scene, trajectory, coefficients) -> dict[str, float]:
    """Means and the first harmonic of lift over the second half of the run."""
    late = trajectory.time > 0.5 * trajectory.time[-1]
    found = harmonic(trajectory.time[late], *coefficients[late].T)
    return {name: value for name, value in found.items() if name != "phase"}


def steady(scene, trajectory, coefficients) -> dict[str, float]:
    """Means over the last quarter of the run."""
    late = trajectory.time > 0.75 * trajectory.time[-1]
    drag, lift = coefficients[late].T
    return {
        "drag": float(drag.mean()),
        "drag_deviation": float(drag.std()),
        "lift_mean": float(lift.mean()),
        "wake_length": wake_length(scene, trajectory, late) / DIAMETER,
    }


def wake_length(scene, trajectory, late) -> float:
    """From the cylinder's back to where the mean velocity on the centre line turns [m]."""
    apart = np.linspace(0.1, BEHIND, 200)
    back = scene.parameters["upstream"] + 0.5 * DIAMETER
    points = np.stack([back + apart, 0.0 * apart], axis=1)
    return last_turn(apart, mean_along(scene, trajectory, late, points))


def _table(rows) -> str:
    head = ("Re", "ghosts", "ends", "a diameter", "width", "ahead",
            "drag", "lift", "Strouhal", "wake", "seconds")  # fmt: skip
    names = ("drag", "lift_amplitude", "strouhal", "wake_length", "seconds")
    found = [
        (number(r["reynolds"]), r["ghosts"], r["ends"], str(r["resolution"]), number(r["width"]),
         number(r["upstream"]), *(number(r.get(name), 4) for name in names)) for r in rows
    ]  # fmt: skip
    return format_rows(head, found)


if __name__ == "__main__":
    raise SystemExit(main())
