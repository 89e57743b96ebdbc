"""Every scene at sizes and smoothing lengths that nobody chose for it.

    python -m benchmarks.scene_sizes
    python -m benchmarks.scene_sizes dam-break --steps 1000

Five odd sizes a scene, from a third of its `small` scale's to somewhat more, with h / dx of 1.5, 2,
3 and 4 in turn (in space 3 at most), everything else as it comes, for a number of steps. Each run
ends *in bounds* (density, speed, distances), *out of bounds*, *refused* before it starts, or in a
named *fault*; the last three with their reason. A row is in the JSON file once it is done.
"""

from __future__ import annotations

import dataclasses
import warnings
from typing import Any

from jaxsph import SimulationError, run_scene
from jaxsph.cli import positive_int
from jaxsph.environment import environment
from jaxsph.scenes import SCENES

from .hard_cases.measures import density_deviation, highest_speed, least_distance
from .measure import format_rows, number
from .table import Table, command

SHARES = (0.37, 0.53, 0.71, 0.9, 1.13)  # of the size that a scene has by itself
SMOOTHING = (1.5, 2.0, 3.0, 4.0, 2.0)
SNAPSHOTS = 10
# Weakly compressible at Ma = 0.1: 0.5 % by the flow, ten times that is none. Water that falls on a
# wall is faster than its reference speed for a moment.
BOUNDS = {"density": 0.05, "speed": 2.0, "distance": 0.2}
KEY = ("scene", "resolution", "h_over_dx", "steps")


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: all in bounds or refused, 1: some are not, 2: bad input."""
    return command("scene_sizes", __doc__, _arguments, _run, argv)


def _arguments(add) -> None:
    add("scenes", nargs="*", choices=[[], *SCENES], metavar="SCENE",
        help=f"of {', '.join(SCENES)} (default: all)")  # fmt: skip
    add("--steps", type=positive_int, default=300, metavar="N", help="of each run (default: 300)")


def _run(options) -> bool:
    kept = Table(options.json, KEY, beside=lambda rows: {"environment": environment()})
    for case in kept.left(cases(options.scenes or SCENES, options.steps)):
        kept.add(case | run(case))
    print(_table(kept.rows))
    return any(row["outcome"] in ("fault", "out of bounds") for row in kept.rows)


def cases(names, steps: int) -> list[dict[str, Any]]:
    """The settings of each scene."""
    found = []
    for name in names:
        usual = SCENES[name]()
        most = 3.0 if usual.space.box.dim == 3 else 4.0  # 2,000 neighbours beyond it
        for share, smoothing in zip(SHARES, SMOOTHING, strict=True):
            odd = 2 * int(0.5 * share * usual.parameters["resolution"]) + 1
            case = (name, odd, min(smoothing, most), steps)
            found.append(dict(zip(KEY, case, strict=True)))
    return found


def run(case: dict[str, Any]) -> dict[str, Any]:
    """How a case ends, and its extremes."""
    try:
        scene = SCENES[case["scene"]](case["resolution"], h_over_dx=case["h_over_dx"])
        each = -(-case["steps"] // SNAPSHOTS)
        end = SNAPSHOTS * each * scene.time_step
        scene = dataclasses.replace(scene, end_time=end, steps_per_snapshot=each)
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", ".*allocated it anew")
            trajectory = run_scene(scene)
    except ValueError as error:
        return {"outcome": "refused", "reason": str(error)}
    except SimulationError as error:
        return {"outcome": "fault", "reason": str(error)}
    found = {
        "density": density_deviation(scene, trajectory),
        "speed": highest_speed(scene, trajectory),
        "distance": least_distance(scene, trajectory),
    }
    kept = {
        "density": found["density"] <= BOUNDS["density"],
        "speed": found["speed"] <= BOUNDS["speed"],
        "distance": found["distance"] >= BOUNDS["distance"],
    }
    broken = [name for name, good in kept.items() if not good]
    return found | {
        "outcome": "out of bounds" if broken else "in bounds",
        "reason": ", ".join(broken),
        "particles": trajectory.particles,
        "time_step": scene.time_step,
        "end_time": float(trajectory.time[-1]),
        "seconds_per_step": trajectory.timing.run_seconds / scene.steps,
    }


def _table(rows: list[dict[str, Any]]) -> str:
    head = ("scene", "N", "h/dx", "outcome", "density", "speed", "nearest/dx", "reason")
    return format_rows(head, [
        (r["scene"], str(r["resolution"]), number(r["h_over_dx"]), r["outcome"],
         *(number(r.get(name)) for name in ("density", "speed", "distance")), r["reason"][:60])
        for r in rows
    ])  # fmt: skip


if __name__ == "__main__":
    raise SystemExit(main())
