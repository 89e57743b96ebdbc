"""The lid-driven cavity beside reference solutions, and how near its particles come to walls.

    python -m benchmarks.lid_driven_cavity --cases settled

`settled`: the constant lid at Re 100, 400 and 1000 in the consistent scheme against Ghia et al.
(1982) and a converged solver (`references/lid_driven_cavity.py`), at three resolutions; from rest
at half the resolution first, where a steady flow is reached at an eighth of the price. `steady`:
at 50 x 50 on for so long that the change of resolution is forgotten. `ghia`: in the delta-plus
scheme at 100 x 100, and the paper's regularised lid. `inside`: 20 s from rest at three
resolutions, how near particles come to walls, and the density. Runs are kept in a folder and
finished rows in the JSON file: the same command goes on.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import jax

from jaxsph import SimulationError, Trajectory
from jaxsph.environment import environment
from jaxsph.scenes import Scene, continued, lid_driven_cavity
from jaxsph.schemes import SCHEMES
from jaxsph_rom.study import full_run, with_record

from .centre_lines import centre_line_errors
from .measure import format_rows, near_walls, number, progress, tell
from .table import Table, command

SNAPSHOTS_PER_SECOND = 5
TIME_STEP = {32: 3.125e-3, 50: 2e-3, 64: 1.5625e-3, 100: 2e-3}  # s; at 100 two thirds of the limit
# name: (scheme, lid, Re, resolution, time before at half the resolution [s], end time [s])
SETS = {
    "steady": tuple(
        ("consistent", "constant", reynolds, 50, before, end)
        for reynolds, before, end in ((100, 20.0, 30.0), (400, 40.0, 40.0), (1000, 80.0, 60.0))
    ),
    "settled": tuple(
        ("consistent", "constant", reynolds, resolution, before, end)
        for resolution in (32, 50, 100)
        for reynolds, before, end in ((100, 20.0, 10.0), (400, 40.0, 10.0), (1000, 80.0, 20.0))
    ),
    "ghia": (
        ("delta-plus", "constant", 100, 100, 20.0, 8.0),
        ("delta-plus", "regularised", 100, 100, 20.0, 8.0),
        ("delta-plus", "constant", 400, 100, 30.0, 8.0),
        ("delta-plus", "constant", 1000, 100, 50.0, 10.0),
    ),
    "inside": tuple(
        ("delta-plus", "regularised", reynolds, resolution, 0.0, 20.0)
        for resolution in (32, 50, 64)
        for reynolds in (100, 400)
    ),
}
KEY = ("scheme", "lid", "reynolds", "resolution", "before", "end_time")


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: a run failed, 2: bad input."""
    return command("lid_driven_cavity", __doc__, _arguments, _run, argv)


def _run(options) -> bool:
    kept, failed = Table(options.json, KEY, beside=_beside), False
    cases = (dict(zip(KEY, values, strict=True)) for name in options.cases for values in SETS[name])
    for case in kept.left(cases):
        try:
            row = run(case, options.out)
        except SimulationError as error:
            tell(f"failed: {error}")
            row, failed = {"fault": str(error)}, True
        kept.add(case | row)
    print(_table(kept.rows))
    return failed


def _beside(rows) -> dict[str, Any]:
    return {"environment": environment()}


def _arguments(add) -> None:
    add("--cases", choices=tuple(SETS), nargs="+", default=list(SETS),
        help="sets of cases (default: all)")  # fmt: skip
    add("--out", type=Path, default=Path("out/lid-driven-cavity"), metavar="DIR",
        help="where runs are kept (default: %(default)s)")  # fmt: skip


def make_scene(case: dict[str, Any], step: float | None = None) -> Scene:
    """The scene of a case, with a few snapshots a second."""
    step = TIME_STEP[case["resolution"]] if step is None else step
    each = max(1, round(1.0 / (SNAPSHOTS_PER_SECOND * step)))
    scene = lid_driven_cavity(
        case["resolution"],
        float(case["reynolds"]),
        lid=case["lid"],
        time_step=case["end_time"] / (each * round(case["end_time"] / (each * step))),
        end_time=case["end_time"],
        scheme=SCHEMES[case["scheme"]],
    )
    return dataclasses.replace(scene, steps_per_snapshot=each)


def run(case: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Errors, what particles did near walls, and times of one run."""
    scene = make_scene(case)
    before = None
    if case["before"]:
        rough = case | {
            "resolution": case["resolution"] // 2, "before": 0.0, "end_time": case["before"]
        }  # fmt: skip
        coarse = make_scene(rough, 2.0 * TIME_STEP[case["resolution"]])
        before = full_run(_folder(folder, rough), coarse, progress)
        scene = with_record(scene, before=case["before"])
        scene = continued(scene, before.state(-1), coarse.space)
    trajectory = full_run(_folder(folder, case), scene, progress)
    timing = trajectory.timing
    return {
        **near_walls(scene, trajectory),
        **centre_line_errors(
            trajectory.time,
            trajectory.position,
            trajectory.velocity,
            scene.space.spacing,
            case["reynolds"],
            case["lid"],
        ),
        "change_in_last_second_percent": _change(trajectory),
        "fault": None,
        # of a run taken up again, extrapolated from its last part
        "seconds": timing.seconds(scene.steps),
        "seconds_before": 0.0 if before is None else before.timing.run_seconds,
        "compile_seconds": timing.compile_seconds,
        "steps": scene.steps,
        "time_step": scene.time_step,
        "dx": scene.space.spacing,
        "particles": trajectory.particles,
        "ghosts": scene.walls.position.shape[0],
        "device": jax.devices()[0].device_kind,
        "environment": environment(),
    }


def _folder(folder: Path, case: dict[str, Any]) -> Path:
    after = f"-after-{case['before']:g}s" if case["before"] else ""
    return folder / f"{case['lid']}-{case['resolution']}-{case['end_time']:g}s{after}"


def _change(trajectory: Trajectory) -> float:
    """Relative change of the kinetic energy over the last second [%]."""
    energy = (trajectory.velocity.astype(float) ** 2).sum(axis=(1, 2))
    before = trajectory.nearest(float(trajectory.time[-1]) - 1.0)
    return float(100.0 * abs(energy[-1] - energy[before]) / energy[-1])


def _table(rows: list[dict[str, Any]]) -> str:
    header = ("scheme", "lid", "Re", "side", "before s", "t s", "u %", "v %", "Ghia u %",
              "Ghia v %", "nearest/dx", "stuck", "density", "run s")  # fmt: skip
    cells = []
    for row in rows:
        low, high = row.get("density_low"), row.get("density_high")
        cells.append((
            row["scheme"], row["lid"], str(row["reynolds"]), str(row["resolution"]),
            number(row["before"]), number(row["end_time"]),
            *(number(row.get(f"{name}_error_percent")) for name in ("u", "v", "ghia_u", "ghia_v")),
            number(row.get("nearest_to_wall_over_dx")), str(row.get("stuck", "-")),
            f"{number(low, 4)}-{number(high, 4)}", number(row.get("seconds")),
        ))  # fmt: skip
    return format_rows(header, cells)


if __name__ == "__main__":
    raise SystemExit(main())
