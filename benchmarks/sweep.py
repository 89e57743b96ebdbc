"""Thousands of Reynolds numbers at once: time beside error, single runs and the full model.

    python -m benchmarks.sweep --scale small

The Taylor-Green vortex as in `benchmarks.tensor_rom`, with ten modes and a linear closure: one call
runs Reynolds numbers evenly spaced over the trained range, each from a start interpolated between
those of the training runs. Some members are judged against full runs on the centre line. Full runs
are those of `benchmarks.tensor_rom` if it has made them.
"""

from __future__ import annotations

import time as clock
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxsph import Trajectory
from jaxsph.cli import SCALES, positive_float, positive_int
from jaxsph.environment import environment
from jaxsph.metrics import centre_line, probe
from jaxsph.scenes import Scene
from jaxsph_rom.points import LinearClosure, TrainedModel, mapped_run, train
from jaxsph_rom.study import full_run

from .measure import format_rows, number, progress, summary, write_json
from .reduced_vortex import HELD_BACK, TRAINED_ON, discrepancies, make_scene
from .table import command

JUDGED = (110.0, 175.0, 240.0)
_REPEATS = 3
_SINGLE_RUNS = 20


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: a full run failed, 2: bad input."""
    return command("sweep", __doc__, _arguments, _run, argv, json="sweep_{scale}.json")


def _run(options) -> None:
    results = _measured(options)
    write_json(options.json, results)
    print(_table(results))


def _arguments(add) -> None:
    add("--scale", choices=SCALES, default="small", help="size of the runs (default: small)")
    add("--resolution", type=positive_int, metavar="N", help="instead of the scale's")
    add("--end-time", type=positive_float, default=1.0, metavar="T", help="[s] (default: 1)")
    add("--members", type=positive_int, default=10_000, metavar="K",
        help="Reynolds numbers in the sweep (default: %(default)s)")  # fmt: skip
    add("--modes", type=positive_int, default=10, metavar="M", help="default: %(default)s")
    add("--iterations", type=positive_int, default=600, metavar="K",
        help="of the closure's training (default: %(default)s)")  # fmt: skip
    add("--judged", type=positive_float, nargs="+", default=list(JUDGED), metavar="RE",
        help="Reynolds numbers of full runs to compare with (default: 110 175 240)")  # fmt: skip
    add("--out", type=Path, metavar="DIR",
        help="where runs are kept (default: out/tensor-rom-SCALE)")  # fmt: skip


def _measured(options) -> dict[str, Any]:
    folder = options.out or Path("out", f"tensor-rom-{options.scale}")
    scenes = {re: make_scene(options, re) for re in sorted({*TRAINED_ON, *options.judged})}
    runs = {re: full_run(folder / "full", scene, progress) for re, scene in scenes.items()}
    trained = train(
        lambda reynolds: make_scene(options, reynolds),
        [{"reynolds": re} for re in TRAINED_ON],
        options.modes,
        runs=[runs[re] for re in TRAINED_ON],
        closure=LinearClosure({"reynolds": HELD_BACK}, iterations=options.iterations),
        progress=progress,
    )
    results = _times(trained, options.members)
    results["judged"] = [_judged(trained, scenes[re], runs[re]) for re in options.judged]
    scene = scenes[TRAINED_ON[0]]
    return results | {
        "particles": runs[TRAINED_ON[0]].particles,
        "modes": options.modes,
        "steps": scene.steps,
        "fom_seconds": [_seconds(scenes[re], run) for re, run in runs.items()],
        "training": trained.training,
        "parameters": scene.parameters,
        "device": jax.devices()[0].device_kind,
        "environment": environment(),
    }


def _times(trained: TrainedModel, members: int) -> dict[str, Any]:
    """Of all members in one call, and of some of them run one by one."""
    reynolds = np.linspace(TRAINED_ON[0], TRAINED_ON[-1], members)
    swept = []
    with progress("sweeps", _REPEATS) as report:
        for _ in range(_REPEATS):
            before = clock.perf_counter()
            prediction = trained.predict({"reynolds": reynolds})
            swept.append((prediction, clock.perf_counter() - before))
            report(1)
    alone = []
    chosen = np.linspace(0, members - 1, 1 + min(members, _SINGLE_RUNS)).astype(int)
    worst = 0.0
    for k in chosen:
        start = jnp.asarray(prediction.coordinates[k, 0])
        before = clock.perf_counter()
        found = trained.flow.predict(start, prediction.values[k], trained.schedule)
        found = np.asarray(found)
        alone.append(clock.perf_counter() - before)
        apart = np.abs(found - prediction.coordinates[k, 1:]).max() / np.abs(found).max()
        worst = max(worst, float(apart))
    return {
        "members": members,
        "stable": int((prediction.status == 0).sum()),
        "sweep_seconds": summary([p.run_seconds for p, _ in swept]),
        "sweep_compile_seconds": swept[0][0].compile_seconds,
        "sweep_seconds_with_all_around_it": swept[-1][1],
        "single_run_seconds": summary(alone[1:]),  # the first compiles
        "largest_difference_from_single_runs": worst,
    }


def _judged(trained: TrainedModel, scene: Scene, run: Trajectory) -> dict[str, Any]:
    """Errors of a member on the centre line beside those of the projection."""
    reynolds, line = scene.parameters["reynolds"], centre_line(scene.space)
    prediction = trained.predict({"reynolds": reynolds})
    flow = trained.flow
    truth = probe(run, line, scene.space)
    projected = flow.project(mapped_run(flow.reference, run, scene.fluid))
    row = {"reynolds": reynolds, "stable": int(prediction.status[0]) == 0}
    found = {"floor_": projected}
    if row["stable"]:
        found[""] = prediction.coordinates[0]
    for prefix, coordinates in found.items():
        fields = flow.fields(jnp.asarray(coordinates), run.time, line)
        profile = np.linalg.norm(fields.velocity, axis=2), fields.pressure
        row |= discrepancies(prefix, truth, profile)
    return row


def _seconds(scene: Scene, run: Trajectory) -> float:
    return run.timing.seconds(scene.steps)


def _table(results: dict[str, Any]) -> str:
    sweep, single = (results[f"{name}_seconds"]["median"] for name in ("sweep", "single_run"))
    full = float(np.median(results["fom_seconds"]))
    header = ("Re", "velocity %", "floor", "pressure %", "median", "floor", "median", "stable")
    rows = [
        (f"{row['reynolds']:g}", *(number(row.get(name)) for name in (
            "velocity_peak_percent", "floor_velocity_peak_percent", "pressure_peak_percent",
            "pressure_median_percent", "floor_pressure_peak_percent",
            "floor_pressure_median_percent")), "yes" if row["stable"] else "no")
        for row in results["judged"]
    ]  # fmt: skip
    return (
        f"{results['members']} Reynolds numbers, {results['stable']} stable: {number(sweep)} s\n"
        f"one by one: {number(1e3 * single)} ms each; the full model: {number(full)} s each\n"
        f"peak discrepancy on the centre line, {results['particles']} particles\n"
        + format_rows(header, rows)
    )


if __name__ == "__main__":
    raise SystemExit(main())
