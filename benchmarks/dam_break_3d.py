"""Water heights of a dam break that meets a box, beside the experiment's gauges.

    python -m benchmarks.dam_break_3d --resolutions 110

The gauges of Kleefsman et al. (2005) are `jaxsph.metrics.surface_height` a spacing wide: all the
water above a place, spray included; the force on the box is not recorded here. The mean distance
from the measured heights over the run is in percent of the column's height; beside it, when the
front reaches each gauge. Every finished run's row is in the JSON file at once; the same command
goes on where it was cut short.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from jaxsph.cli import positive_float, positive_int
from jaxsph.metrics import surface_height
from jaxsph.scenes import dam_break_3d
from jaxsph.scenes.dam_break_3d import COLUMN, GAUGES
from jaxsph.schemes import SCHEMES

from .measure import format_rows, number
from .open_flows import ran
from .references.dam_break_3d import ARRIVAL, ARRIVED, HEIGHT, TIME
from .table import Table, command

KEY = ("scheme", "resolution", "h_over_dx", "end_time")


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: a run was lost, 2: bad input."""
    return command("dam_break_3d", __doc__, _arguments, _run, argv)


def _arguments(add) -> None:
    add("--resolutions", type=positive_int, nargs="+", default=[110], metavar="N",
        help="particles along the tank (default: 110)")  # fmt: skip
    add("--schemes", choices=tuple(SCHEMES), nargs="+", default=["consistent"],
        help="default: consistent")  # fmt: skip
    add("--h-over-dx", type=positive_float, default=1.3, metavar="X", help="default: 1.3")
    add("--t-end", type=positive_float, default=1.2, metavar="T", help="default: 1.2 s")


def _run(options) -> bool:
    if options.t_end > TIME[-1]:
        raise ValueError(f"--t-end: the experiment's heights are known up to {TIME[-1]:g} s.")
    kept = Table(options.json, KEY)
    cases = (
        dict(zip(KEY, (scheme, n, options.h_over_dx, options.t_end), strict=True))
        for n in options.resolutions
        for scheme in options.schemes
    )
    for case in kept.left(cases):
        kept.add(case | run(case))
    print(_table(kept.rows))
    return any(row["fault"] for row in kept.rows)


def run(case: dict[str, Any]) -> dict[str, Any]:
    """Heights at the gauges, how far they are from the measured ones, and what the run took."""
    options = {name: case[name] for name in KEY[1:]}
    scene = dam_break_3d(scheme=SCHEMES[case["scheme"]], **options)
    label = f"{case['scheme']}, {case['resolution']} along the tank"
    trajectory, row = ran(scene, label, measure=None, averaged=None)
    return row | compared(
        trajectory.time,
        {name: surface_height(trajectory, scene, place) for name, place in GAUGES.items()},
    )


def compared(time: np.ndarray, heights: dict[str, np.ndarray]) -> dict[str, Any]:
    """Of each gauge: height at the experiment's times, mean distance from it, arrival."""
    there = TIME[time[-1] + 1e-9 >= TIME]
    found: dict[str, Any] = {"time": there.tolist()}
    for name, height in heights.items():
        ours, theirs = np.interp(there, time, height), np.asarray(HEIGHT[name])[: len(there)]
        found[name] = ours.tolist()
        found[f"{name}_off_percent"] = float(100.0 * np.abs(ours - theirs).mean() / COLUMN[2])
        if name in ARRIVAL:
            wet = np.flatnonzero(height > ARRIVED)
            found[f"{name}_arrival"] = float(time[wet[0]]) if len(wet) else None
    return found


def _table(rows) -> str:
    head = ("scheme", "along", "particles", *(f"{name} off %" for name in GAUGES),
            *(f"at {name}" for name in ARRIVAL), "seconds")  # fmt: skip
    names = (*(f"{g}_off_percent" for g in GAUGES), *(f"{g}_arrival" for g in ARRIVAL), "seconds")
    found = [
        (r["scheme"], str(r["resolution"]), str(r["particles"]),
         *(number(r[name], 3) for name in names)) for r in rows
    ]  # fmt: skip
    return format_rows(head, found)


if __name__ == "__main__":
    raise SystemExit(main())
