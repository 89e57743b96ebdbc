"""Beyond the time that a model was trained on: learnt from [0, 0.7] s, judged on [0.7, 1] s.

    python -m benchmarks.extrapolation --scale small

The Taylor-Green vortex as in `benchmarks.tensor_rom`, but basis, system and closure see the first
part of the training runs only. Each prediction runs from the start to the end; its errors on the
centre line stand for both parts of time apart, beside those of the projection on the same modes.
"""

from __future__ import annotations

import dataclasses
import time as clock
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxsph import Trajectory
from jaxsph.cli import SCALES, positive_float, positive_int
from jaxsph.environment import environment
from jaxsph.metrics import centre_line
from jaxsph.scenes import Scene
from jaxsph_rom.points import LinearClosure, TrainedModel, mapped_run, train_each
from jaxsph_rom.study import full_run

from .measure import format_rows, number, progress, write_json
from .reduced_vortex import HELD_BACK, PREDICTED, TRAINED_ON, discrepancies, make_scene, profile_of
from .table import command

_FIELDS = ("time", "position", "velocity", "density", "pressure")
_PARTS = ("trained", "beyond")


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: a full run failed, 2: bad input."""
    return command(
        "extrapolation", __doc__, _arguments, _run, argv, json="extrapolation_{scale}.json"
    )


def _arguments(add) -> None:
    add("--scale", choices=SCALES, default="small", help="size of the runs (default: small)")
    add("--resolution", type=positive_int, metavar="N", help="instead of the scale's")
    add("--end-time", type=positive_float, default=1.0, metavar="T", help="[s] (default: 1)")
    add("--until", type=positive_float, default=0.7, metavar="T",
        help="end of what is learnt from [s] (default: 0.7)")  # fmt: skip
    add("--predict", type=positive_float, nargs="+", default=list(PREDICTED), metavar="RE",
        help="Reynolds numbers to run at (default: 110 125 175 225 240)")  # fmt: skip
    add("--modes", type=positive_int, nargs="+", default=[5, 10, 20], metavar="M",
        help="numbers of modes (default: 5 10 20)")  # fmt: skip
    add("--iterations", type=positive_int, default=600, metavar="K",
        help="of the closure's training (default: %(default)s)")  # fmt: skip
    add("--out", type=Path, metavar="DIR",
        help="where runs are kept (default: out/tensor-rom-SCALE)")  # fmt: skip


def _run(options) -> None:
    if not options.until < options.end_time:
        raise ValueError(f"--until: must be below the end time of {options.end_time:g} s.")
    results = _measured(options)
    write_json(options.json, results)
    print(_table(results))


def _measured(options) -> dict[str, Any]:
    folder = options.out or Path("out", f"tensor-rom-{options.scale}")
    scenes = {re: make_scene(options, re) for re in sorted({*TRAINED_ON, *options.predict})}
    runs = {re: full_run(folder / "full", scene, progress) for re, scene in scenes.items()}
    seen = [_until(runs[re], options.until) for re in TRAINED_ON]
    window = min(50, len(seen[0].time) - 1)

    def make(reynolds):
        return dataclasses.replace(make_scene(options, reynolds), end_time=options.until)

    rows = []
    for closure in (None, LinearClosure({"reynolds": HELD_BACK}, window, options.iterations)):
        flows = train_each(
            make, [{"reynolds": re} for re in TRAINED_ON], options.modes, runs=seen,
            closure=closure, progress=progress,
        )  # fmt: skip
        for trained in flows:
            for re in options.predict:
                rows.append(_judged(trained, scenes[re], runs[re], options.until))
    scene = scenes[TRAINED_ON[0]]
    return {
        "particles": runs[TRAINED_ON[0]].particles,
        "until": options.until,
        "end_time": options.end_time,
        "trained_on": TRAINED_ON,
        "parameters": scene.parameters,
        "rows": rows,
        "device": jax.devices()[0].device_kind,
        "environment": environment(),
    }


def _until(run: Trajectory, time: float) -> Trajectory:
    """The snapshots of a run up to a time [s]."""
    count = int((run.time <= time * (1.0 + 1e-9)).sum())
    cut = {name: getattr(run, name)[:count] for name in _FIELDS}
    return dataclasses.replace(run, **cut, metadata={})


def _judged(trained: TrainedModel, scene: Scene, run: Trajectory, until: float) -> dict[str, Any]:
    """Errors of a prediction in both parts of time, those of the projection, and times."""
    flow, reynolds = trained.flow, scene.parameters["reynolds"]
    before = clock.perf_counter()
    trained.predict({"reynolds": reynolds}, times=run.time)
    first = clock.perf_counter() - before
    prediction = trained.predict({"reynolds": reynolds}, times=run.time)
    row = {
        "reynolds": reynolds,
        "modes": flow.basis.size,
        "closure": trained.training["closure"],
        "stable": int(prediction.status[0]) == 0,
        "reduced_seconds": prediction.run_seconds,
        "reduced_seconds_with_compilation": first,
        "full_seconds": run.timing.seconds(scene.steps),
    }
    truth, line = profile_of(scene, run), centre_line(scene.space)
    projected = flow.project(mapped_run(flow.reference, run, scene.fluid))
    beyond = run.time > until * (1.0 + 1e-9)
    found = {"floor": projected} | ({"error": prediction.coordinates[0]} if row["stable"] else {})
    for kind, coordinates in found.items():
        fields = flow.fields(jnp.asarray(coordinates), run.time, line)
        profile = np.linalg.norm(fields.velocity, axis=2), fields.pressure
        for part, chosen in zip(_PARTS, (~beyond, beyond), strict=True):
            apart = [tuple(a[chosen] for a in both) for both in (truth, profile)]
            row |= discrepancies(f"{part}_{kind}_", *apart)
    return row


def _table(results: dict[str, Any]) -> str:
    header = ("Re", "M", "closure", "velocity %", "beyond", "floor", "pressure %", "beyond",
              "floor", "full s", "reduced ms")  # fmt: skip
    rows = [
        (f"{row['reynolds']:g}", str(row["modes"]), row["closure"],
         *(number(row.get(f"{name}_peak_percent")) for name in (
             "trained_error_velocity", "beyond_error_velocity", "beyond_floor_velocity",
             "trained_error_pressure", "beyond_error_pressure", "beyond_floor_pressure")),
         number(row["full_seconds"]), number(1e3 * row["reduced_seconds"]))
        for row in results["rows"]
    ]  # fmt: skip
    told = f"peak discrepancy up to {results['until']:g} s and beyond, to {results['end_time']:g} s"
    return f"{told}; {results['particles']} particles\n" + format_rows(header, rows)


if __name__ == "__main__":
    raise SystemExit(main())
