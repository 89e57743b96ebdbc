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
import numpy as np

from jaxsph.cli import SCALES, positive_float, positive_int
from jaxsph.environment import environment
from jaxsph.scenes import Scene
from jaxsph_rom.points import ProjectedRun, ReducedFlow, fit_linear_closure, mapped_run
from jaxsph_rom.study import full_run

from .measure import (
    format_rows,
    number,
    progress,
    tell,
)
from .reduced_vortex import HELD_BACK, PREDICTED, TRAINED_ON, judged, make_scene, profile_of, train
from .table import Table, command

CLOSURES = ("none", "linear")
KEY = ("reynolds", "modes", "closure")


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
