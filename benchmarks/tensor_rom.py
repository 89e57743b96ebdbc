"""Reduced models on reference points: error beside online time and offline cost.

    python -m benchmarks.tensor_rom --scale small

The Taylor-Green vortex from stirred particles and a balanced start: trained at Re 100, 150, 200 and
250, run at Reynolds numbers in between, with and without a linear closure. The closure learns from
Re 100, 150 and 250; Re 200 is held back and decides which of its iterations is kept. Runs are kept
in a folder and finished rows in the JSON file: the same command goes on.
"""

from __future__ import annotations

import time as clock
from itertools import product
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxsph import SimulationError, Trajectory
from jaxsph.arrangements import Lattice, Stirred
from jaxsph.cli import SCALES, positive_float, positive_int
from jaxsph.environment import environment
from jaxsph.metrics import centre_line, probe, relative_discrepancy
from jaxsph.scenes import Scene, taylor_green
from jaxsph_rom.points import ProjectedRun, ReducedFlow, fit_linear_closure, mapped_run
from jaxsph_rom.study import full_run, quiet

from .measure import (
    format_rows,
    number,
    progress,
    repeated,
    summary,
    tell,
)
from .table import Table, command

TRAINED_ON = (100.0, 150.0, 200.0, 250.0)
HELD_BACK = 200.0
PREDICTED = (110.0, 125.0, 175.0, 225.0, 240.0)  # 110 and 240: no choice was made by them
CLOSURES = ("none", "linear")
KEY = ("reynolds", "modes", "closure")
_REPEATS = 5


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: a full run failed, 2: bad input."""
    return command("tensor_rom", __doc__, _arguments, _run, argv, json="tensor_rom_{scale}.json")


def _arguments(add) -> None:
    add("--scale", choices=SCALES, default="small", help="size of the runs (default: small)")
    add("--resolution", type=positive_int, metavar="N", help="instead of the scale's")
    add("--end-time", type=positive_float, default=1.0, metavar="T", help="[s] (default: 1)")
    add("--predict", type=positive_float, nargs="+", default=list(PREDICTED), metavar="RE",
        help="Reynolds numbers to run at (default: 110 125 175 225 240)")  # fmt: skip
    add("--modes", type=positive_int, nargs="+", default=[5, 10, 20], metavar="M",
        help="numbers of modes (default: 5 10 20)")  # fmt: skip
    add("--iterations", type=positive_int, default=600, metavar="K",
        help="of the closure's training (default: %(default)s)")  # fmt: skip
    add("--out", type=Path, metavar="DIR",
        help="where runs are kept (default: out/tensor-rom-SCALE)")  # fmt: skip


def _run(options) -> None:
    settings = {
        name: getattr(options, name) for name in ("scale", "resolution", "end_time", "iterations")
    }
    kept = Table(options.json, KEY, settings=settings)
    kept.results.setdefault("offline", [])
    wanted = product(options.predict, options.modes, CLOSURES)
    if all(map(kept.has, wanted)):
        tell("all done before")
        return print(_table(kept.results))
    folder = options.out or Path("out", f"tensor-rom-{options.scale}")
    scenes = {re: make_scene(options, re) for re in sorted({*TRAINED_ON, *options.predict})}
    runs = {re: full_run(folder / "full", scene, progress) for re, scene in scenes.items()}
    scene = scenes[TRAINED_ON[0]]
    start = clock.perf_counter()
    largest = train(scene, [runs[re] for re in TRAINED_ON], max(options.modes))
    trained = clock.perf_counter() - start
    mapped = {re: mapped_run(largest.reference, run, scene.fluid) for re, run in runs.items()}
    kept.results |= {
        "particles": runs[TRAINED_ON[0]].particles,
        "parameters": scene.parameters,
        "trained_on": TRAINED_ON,
        "held_back": HELD_BACK,
        "device": jax.devices()[0].device_kind,
        "environment": environment(),
    }
    truth = {re: profile_of(scenes[re], run) for re, run in runs.items()}
    for modes in options.modes:
        flow = largest.truncated(modes)
        projected = {re: np.asarray(flow.project(fields)) for re, fields in mapped.items()}
        for closure in CLOSURES:
            left = [re for re in options.predict if not kept.has((re, modes, closure))]
            if not left:
                continue
            closed, offline = flow, {"modes": modes, "closure": closure, "training_s": trained}
            if closure == "linear":
                closed, offline["closure_s"] = _closed(flow, scene, projected, options.iterations)
            kept.results["offline"].append(offline)
            for re in left:
                row = {"reynolds": re, "modes": modes, "closure": closure}
                kept.add(row | judged(closed, scenes[re], runs[re], projected[re], truth[re]))
    print(_table(kept.results))


def train(scene: Scene, runs: list[Trajectory], modes: int) -> ReducedFlow:
    """A reduced flow on a lattice of reference points."""
    tell(f"training, M = {modes}")
    flow = ReducedFlow.train(scene, runs, Lattice().positions(scene.space), modes)
    return jax.block_until_ready(flow)


def make_scene(options, reynolds: float, time_step: float | None = None) -> Scene:
    """Stirred particles at a balanced pressure."""
    scene = taylor_green(
        options.resolution,
        reynolds,
        scale=options.scale,
        end_time=options.end_time,
        time_step=time_step,
        arrangement=Stirred(),
        dtype="float64",
    )
    return quiet(scene)


def _closed(flow: ReducedFlow, scene: Scene, projected, iterations: int):
    """The flow with a closure, and the time that it took to learn."""
    runs = {re: ProjectedRun(1.0 / re, projected[re]) for re in TRAINED_ON}
    window = min(50, len(projected[HELD_BACK]) - 1)
    start = clock.perf_counter()
    with progress(f"closure, M = {flow.basis.size}", iterations) as report:
        fitted = fit_linear_closure(
            flow.system,
            [run for re, run in runs.items() if re != HELD_BACK],
            scene.time_step,
            scene.steps_per_snapshot,
            held_back=runs[HELD_BACK],
            window=window,
            iterations=iterations,
            progress=report,
        )
    seconds = clock.perf_counter() - start
    return ReducedFlow(flow.reference, flow.basis, fitted.system, flow.fluid), seconds


def profile_of(scene: Scene, run: Trajectory):
    return probe(run, centre_line(scene.space), scene.space)


def judged(flow: ReducedFlow, scene: Scene, run: Trajectory, projected, truth) -> dict[str, Any]:
    """Errors on the centre line, the projection's own as a floor, and times."""
    snapshots = len(run.time) - 1
    arguments = (1.0 / scene.parameters["reynolds"], scene.time_step, scene.steps_per_snapshot)
    first = jnp.asarray(projected[0])
    first_seconds, seconds, fault, found = None, [], None, None
    try:
        found, first_seconds, seconds = repeated(
            lambda: flow.predict(first, *arguments, snapshots), _REPEATS
        )
    except SimulationError as error:
        fault = str(error)
    metadata = run.metadata
    row = {
        "stable": fault is None,
        "fault": fault,
        "rom_compile_and_first_seconds": first_seconds,
        "rom_seconds": summary(seconds),
        "fom_seconds": metadata["run_seconds"] * scene.steps / metadata["steps"],
        "steps": scene.steps,
    }
    line = centre_line(scene.space)

    def profile(coordinates):
        fields = flow.fields(coordinates, run.time, line)
        return np.linalg.norm(fields.velocity, axis=2), fields.pressure

    row |= discrepancies("floor_", truth, profile(jnp.asarray(projected)))
    if found is not None:
        row |= discrepancies("", truth, profile(jnp.concatenate([first[None], found])))
    return row


def discrepancies(prefix: str, truth, found) -> dict[str, float]:
    """Peak and median over time of the discrepancy of velocity norm and pressure."""
    row = {}
    for name, a, b in zip(("velocity", "pressure"), truth, found, strict=True):
        over_time = relative_discrepancy(a, b)
        row[f"{prefix}{name}_peak_percent"] = float(over_time.max())
        row[f"{prefix}{name}_median_percent"] = float(np.median(over_time))
    return row


def _table(results: dict[str, Any]) -> str:
    header = ("Re", "M", "closure", "velocity %", "floor", "pressure %", "median", "floor",
              "median", "full s", "reduced ms", "stable")  # fmt: skip
    rows = []
    for row in results["rows"]:
        seconds = row["rom_seconds"]["median"]
        rows.append((
            f"{row['reynolds']:g}", str(row["modes"]), row["closure"],
            *(number(row.get(name)) for name in (
                "velocity_peak_percent", "floor_velocity_peak_percent", "pressure_peak_percent",
                "pressure_median_percent", "floor_pressure_peak_percent",
                "floor_pressure_median_percent", "fom_seconds")),
            number(None if seconds is None else 1e3 * seconds), "yes" if row["stable"] else "no",
        ))  # fmt: skip
    return f"peak discrepancy on the centre line, {results['particles']} particles\n" + format_rows(
        header, rows
    )


if __name__ == "__main__":
    raise SystemExit(main())
