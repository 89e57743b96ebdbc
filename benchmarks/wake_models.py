"""Reduced models of a cylinder's wake: frequency, drag, lift and phase at unseen Reynolds numbers.

    python -m benchmarks.wake_models --modes 8 14 20

A model on points of runs at three Reynolds numbers, of the developed wake or of one that begins to
shed from the steady wake of Re = 40 (`--start steady`), tensors without a closure unless one is
asked for. At unseen numbers it starts where the full run starts and is followed for as long as
that; drag and lift are outputs learnt on the training runs (`fit_forces`). Both runs' lift is a
sine over their second half, their last third from a steady wake: Strouhal numbers and amplitudes
are those of it, the phase is that at its end. Beside them the error of the velocity over all points
and times, its floor, and the time, the full model's by some steps in the same process. Runs are
kept in a folder, results as they come: the same command goes on where it was cut short.
"""

from __future__ import annotations

import dataclasses
import time as clock
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

import jaxsph_rom
from jaxsph import run_scene
from jaxsph.cli import positive_float, positive_int
from jaxsph.environment import environment
from jaxsph.scenes.cylinder import DIAMETER, SPEED
from jaxsph_rom.points import fit_forces, mapped_run, train_each

from .measure import format_rows, number, progress
from .table import Table, command
from .wake_runs import WakeRuns, harmonic, onset

KEY = ("resolution", "start", "trained_on", "recorded", "modes", "closure", "reynolds",
       "seconds_of_flow")  # fmt: skip
UNSEEN = {95.0: 18.0, 125.0: 60.0}  # Reynolds number: s of flow of a developed wake
_TIMED = 8  # snapshots of the full run that are timed beside the reduced one
COMPARED = ("strouhal", "drag", "lift_amplitude")
_DIFFERENCE = 1e-3  # of the Reynolds number


class Start(NamedTuple):
    """What the runs of a table start from."""

    recorded: float  # s of each training run
    window: int  # snapshots that a closure follows at a time
    late: float  # from when on lift is a sine, of the run
    folder: str  # of the runs
    runs: dict[str, float]  # options of `WakeRuns`


STARTS = {
    "developed": Start(18.0, 50, 0.5, "", {}),
    "steady": Start(
        75.0, 100, 2.0 / 3.0, "from-steady", {"first": 40.0, "developed": 40.0, "adapted": 0.0}
    ),
}


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: a prediction is lost, 2: bad input."""
    return command("wake_models", __doc__, _arguments, _run, argv)


def _arguments(add) -> None:
    add("--resolution", type=positive_int, default=10, metavar="N",
        help="particles a diameter (default: 10)")  # fmt: skip
    add("--train", type=positive_float, nargs="+", default=[80.0, 110.0, 140.0], metavar="RE",
        help="default: 80 110 140")  # fmt: skip
    add("--modes", type=positive_int, nargs="+", default=[8, 14, 20], metavar="M",
        help="default: 8 14 20")  # fmt: skip
    add("--start", choices=tuple(STARTS), default="developed",
        help="the wake that sheds, or the steady one of Re = 40 (default: developed)")  # fmt: skip
    add("--recorded", type=positive_float, metavar="S",
        help="of flow in each training run [s] (default: 18 developed, 75 steady)")  # fmt: skip
    add("--unseen", type=positive_float, nargs="+", default=list(UNSEEN), metavar="RE",
        help="default: 95 125")  # fmt: skip
    add("--seconds", type=positive_float, metavar="S",
        help="of an unseen flow that are followed (default: 18 at 95, else 60)")  # fmt: skip
    add("--twice", action="store_true",
        help="a second full run beside each new row, of particles moved by 0.001 dx")  # fmt: skip
    add("--closure", choices=("none", "linear"), default="none", help="default: none")
    add("--out", type=Path, default=Path("out/wake"), metavar="DIR",
        help="where runs are kept (default: %(default)s)")  # fmt: skip


def _run(options) -> bool:
    kept = Table(options.json, KEY, beside=lambda rows: {"environment": environment()})
    trained_on = "-".join(f"{r:g}" for r in options.train)
    start = STARTS[options.start]
    recorded = options.recorded or start.recorded
    shared = (options.resolution, options.start, trained_on, recorded)
    unseen = [(re, options.seconds or UNSEEN.get(re, 60.0)) for re in options.unseen]
    cases = [
        dict(zip(KEY, (*shared, modes, options.closure, *each), strict=True))
        for modes in options.modes
        for each in unseen
    ]
    left = list(kept.left(cases))
    if left:
        folder = options.out / start.folder
        runs = WakeRuns(folder, options.resolution, recorded=recorded, **start.runs)
        models = _models(runs, options, sorted({case["modes"] for case in left}))
        for modes, (model, drag) in models:
            for case in (case for case in left if case["modes"] == modes):
                kept.add(case | judge(model, drag, runs, case, options.twice))
    print(_table(kept.rows))
    return any(row["fault"] for row in kept.rows)


def _models(runs: WakeRuns, options, sizes):
    trained = {reynolds: runs.run(reynolds) for reynolds in options.train}

    def make(reynolds):
        known = trained.get(float(reynolds))
        return runs.scene(reynolds, runs.recorded) if known is None else known[0]

    learnt = jaxsph_rom.LinearClosure(window=STARTS[options.start].window)
    closure = learnt if options.closure == "linear" else None
    points = [{"reynolds": reynolds} for reynolds in options.train]
    full = [run for _, run in trained.values()]
    models = train_each(
        jaxsph_rom.Family(make, starts=False), points, sizes, runs=full, closure=closure,
        progress=progress,
    )  # fmt: skip
    for model in models:
        yield model.flow.basis.size, (model, fit_forces(model, full, "cylinder"))


def judge(model, forces, runs: WakeRuns, case: dict[str, Any], twice: bool) -> dict[str, Any]:
    """A prediction at an unseen number beside the full run, and a second one of these."""
    reynolds, seconds = case["reynolds"], case["seconds_of_flow"]
    scene, full = runs.run(reynolds, seconds)
    reduced = model.predict({"reynolds": reynolds}, start=scene, times=full.time)
    row = {
        "fault": None if reduced.status[0] == 0 else f"lost at {reduced.time[reduced.step[0]]:g} s",
        "expected_error_percent": 100.0 * float(reduced.error_indicator[0]),
        "full_seconds": _full_seconds(scene),
        "particles": full.particles,
    }
    if row["fault"]:
        return row
    values = jnp.asarray(reduced.values[0])
    mine = 2.0 * np.asarray(forces(jnp.asarray(reduced.coordinates[0]), values))
    mine /= SPEED**2 * DIAMETER
    mine[1:] = 0.5 * (mine[1:] + mine[:-1])  # means between snapshots, as theirs are
    late = full.time > STARTS[case["start"]].late * full.time[-1]

    def wave_of(each):
        found = harmonic(full.time[late], *each[late].T)
        if case["start"] == "steady":
            found["onset"] = onset(full.time[1:], each[1:, 1])
        return found

    true = wave_of(_coefficients(full))
    flow = model.flow
    fields = np.moveaxis(mapped_run(flow.reference, full, flow.fluid), -1, 0)
    modes, centre = (np.asarray(part) for part in (flow.basis.modes, flow.basis.centre))
    own = np.asarray(flow.project(jnp.asarray(np.moveaxis(fields, 0, -1))))
    found, best = (
        centre[None] + np.einsum("gfm,tm->tgf", modes, np.asarray(a))
        for a in (reduced.coordinates[0], own)
    )
    largest = np.linalg.norm(fields[:, :, 1:], axis=(1, 2)).max()
    off, floor = (
        100.0 * np.linalg.norm((each - fields)[:, :, 1:], axis=(1, 2)).max() / largest
        for each in (found, best)
    )
    timed = model.predict({"reynolds": reynolds}, start=scene, times=full.time)
    again = wave_of(_coefficients(runs.run(reynolds, seconds, True)[1])) if twice else None
    return row | {
        **{f"{name}_full": true[name] for name in (*COMPARED, "onset") if name in true},
        **beside(wave_of(mine), true),
        "full_again": None if again is None else beside(again, true),
        "periods": true["strouhal"] * seconds,
        "velocity_error_percent": off,
        "velocity_floor_percent": floor,
        "reduced_seconds": timed.run_seconds,
        "times_faster": row["full_seconds"] / timed.run_seconds,
        **_gradient(model, forces, scene, reynolds, full.time),
    }


def _coefficients(full):
    return 2.0 * full.mean_forces["cylinder"] / (SPEED**2 * DIAMETER)


def beside(wave: dict[str, float], true: dict[str, float]) -> dict[str, float]:
    """A wake's figures, and how far from another's; the phase at the end, of a period."""
    apart = (wave["phase"] - true["phase"]) / (2.0 * np.pi)
    off = {name: 100.0 * abs(wave[name] / true[name] - 1.0) for name in COMPARED}
    return {
        **{name: wave[name] for name in (*COMPARED, "onset") if name in wave},
        **{f"{name.removesuffix('_amplitude')}_error_percent": off[name] for name in COMPARED},
        "phase_error_percent_of_a_period": 100.0 * abs((apart + 0.5) % 1.0 - 0.5),
    }


def _full_seconds(scene) -> float:
    """What the full run takes beside the prediction, by some of its steps [s]."""
    steps = _TIMED * scene.steps_per_snapshot
    some = dataclasses.replace(scene, end_time=steps * scene.time_step)
    return run_scene(some).timing.seconds(scene.steps)


def _gradient(model, forces, scene, reynolds: float, times) -> dict[str, float]:
    """d(mean drag)/d(Re) by reverse mode, and by central differences."""

    @jax.jit
    def drag(number):
        found = model.predict({"reynolds": number}, start=scene, times=times)
        return jnp.mean(forces(found.coordinates[0], found.values[0])[:, 0])

    number, step = jnp.asarray(reynolds), _DIFFERENCE * reynolds
    before = clock.perf_counter()
    slope = float(jax.grad(drag)(number))
    by_difference = float((drag(number + step) - drag(number - step)) / (2.0 * step))
    return {
        "drag_slope": slope,
        "drag_slope_off": abs(slope / by_difference - 1.0),
        "slope_seconds_with_compilation": clock.perf_counter() - before,
    }


def _table(rows) -> str:
    head = ("M", "Re", "periods", "Strouhal %", "drag %", "lift %", "phase %", "velocity %",
            "floor %", "faster")  # fmt: skip
    names = ("modes", "reynolds", "periods", "strouhal_error_percent", "drag_error_percent",
             "lift_error_percent", "phase_error_percent_of_a_period", "velocity_error_percent",
             "velocity_floor_percent", "times_faster")  # fmt: skip
    found = [[number(row.get(name)) for name in names] for row in rows]
    return format_rows(head, found)


if __name__ == "__main__":
    raise SystemExit(main())
