"""Flow over a backward-facing step: where it comes back to the wall, beside Erturk (2008).

    python -m benchmarks.backward_facing_step --resolutions 10 20

Means over the last quarter of each run. The place is that of no velocity one and two spacings off
the wall, carried on to the wall by a straight line. Finished rows are in the JSON file: the same
command goes on.
"""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np

from jaxsph.cli import positive_float, positive_int
from jaxsph.scenes import backward_facing_step
from jaxsph.scenes.backward_facing_step import HEIGHT, MEAN, REATTACHMENT, STEP

from .measure import format_rows, number
from .open_flows import last_turn, mean_along, ran
from .table import Table, command

KEY = ("reynolds", "resolution", "downstream", "end_time")
DOWNSTREAM = {100.0: 10.0, 200.0: 14.0}  # m
END_TIME = {100.0: 40.0, 200.0: 80.0}  # s
SHORTEST = 4.0  # s: snapshots in the last quarter and in the one before


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: a run failed, 2: bad input."""
    return command("backward_facing_step", __doc__, _arguments, _run, argv)


def _arguments(add) -> None:
    add("--reynolds", type=positive_float, nargs="+", choices=tuple(DOWNSTREAM),
        default=list(DOWNSTREAM), metavar="RE", help="of 100 and 200 (default: both)")  # fmt: skip
    add("--resolutions", type=positive_int, nargs="+", default=[10], metavar="N",
        help="particles over the step (default: 10)")  # fmt: skip
    add("--t-end", type=positive_float, metavar="T", help="default: 40 s, 80 s")


def _run(options) -> bool:
    if options.t_end is not None and options.t_end < SHORTEST:
        raise ValueError(f"--t-end: at least {SHORTEST:g} s, for means over its last two quarters.")
    kept = Table(options.json, KEY)
    cases = (
        dict(zip(KEY, (re, n, DOWNSTREAM[re], options.t_end or END_TIME[re]), strict=True))
        for n, re in product(options.resolutions, options.reynolds)
    )
    for case in kept.left(cases):
        kept.add(case | run(case))
    print(_table(kept.rows))
    return any(row["fault"] for row in kept.rows)


def run(case: dict[str, Any]) -> dict[str, Any]:
    """Where a run's flow comes back to the wall, what flows past, and what that took."""
    reynolds, resolution = case["reynolds"], case["resolution"]
    others = {name: case[name] for name in KEY[2:]}
    scene = backward_facing_step(resolution, reynolds, **others)
    trajectory, row = ran(scene, f"Re {reynolds:g}, {resolution} over the step")
    return row if row["fault"] else row | judged(scene, trajectory, REATTACHMENT[reynolds])


def judged(scene, trajectory, expected: float) -> dict[str, float]:
    """The place, its change from the quarter before, and the flux, with their errors."""
    time, end = trajectory.time, trajectory.time[-1]
    late, before = time > 0.75 * end, (time > 0.5 * end) & (time <= 0.75 * end)
    found, earlier = (reattachment(scene, trajectory, of) for of in (late, before))
    flux = np.mean([passing(scene, trajectory, late, x) for x in (1.0, -1.0)])
    return {
        "reattachment": found,
        "reattachment_error_percent": 100.0 * (found / expected - 1.0),
        "change_percent": 100.0 * (found / earlier - 1.0),
        "flux_error_percent": 100.0 * (flux / (MEAN * HEIGHT) - 1.0),
    }


def reattachment(scene, trajectory, of) -> float:
    """Behind the step, over its height."""
    face, dx = scene.parameters["upstream"], scene.space.spacing
    behind = np.linspace(0.5, 0.9 * scene.parameters["downstream"], 400)
    rows = []
    for off in (dx, 2.0 * dx):
        points = np.stack([face + behind, np.full_like(behind, -STEP + off)], axis=1)
        rows.append(last_turn(behind, mean_along(scene, trajectory, of, points)))
    return (2.0 * rows[0] - rows[1]) / STEP


def passing(scene, trajectory, of, beside: float) -> float:
    """What flows over a section [m^2/s], so far behind the inflow if positive, else before the
    wide channel's end."""
    params = scene.parameters
    x = beside if beside > 0.0 else params["upstream"] + params["downstream"] + beside
    low = 0.0 if beside > 0.0 else -STEP
    edges = np.linspace(low, HEIGHT, 1 + 2 * round((HEIGHT - low) / scene.space.spacing))
    middle = 0.5 * (edges[1:] + edges[:-1])
    points = np.stack([np.full_like(middle, x), middle], axis=1)
    return float(np.sum(mean_along(scene, trajectory, of, points) * np.diff(edges)))


def _table(rows) -> str:
    names = ("reattachment", "reattachment_error_percent", "change_percent", "flux_error_percent",
             "seconds")  # fmt: skip
    found = [
        (number(r["reynolds"]), str(r["resolution"]), *(number(r.get(n), 4) for n in names))
        for r in rows
    ]
    head = ("Re", "over the step", "reattachment", "error %", "change %", "flux %", "seconds")
    return format_rows(head, found)


if __name__ == "__main__":
    raise SystemExit(main())
