"""Sampled reduced models on reference points: error against the number of samples.

    python -m benchmarks.sampled_rom --scale small

The Taylor-Green vortex as in `benchmarks.tensor_rom`: trained at Re 100, 150, 200 and 250, run at
one of these. Beside each selection and number of samples stand the projection's own error as a
floor, the exact tensors, and the same equations with every point a sample. Runs are kept in a
folder, those of `benchmarks.tensor_rom` among them, and finished rows in the JSON file: the same
command goes on.
"""

from __future__ import annotations

import time as clock
from itertools import product
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from jaxsph.cli import SCALES, positive_float, positive_int
from jaxsph.environment import environment
from jaxsph.integrate import Model, integrate
from jaxsph.metrics import centre_line, probe
from jaxsph_rom.points import (
    QDEIM,
    Chosen,
    EulerianRates,
    NonNegativeWeights,
    PointsModel,
    SampledRates,
    VisitedStates,
    mapped_run,
    rate_basis,
)
from jaxsph_rom.study import full_run

from .measure import format_rows, number, progress, tell
from .reduced_vortex import TRAINED_ON, discrepancies, make_scene, train
from .table import Table, command

SELECTIONS = {"q-deim": QDEIM, "non-negative": NonNegativeWeights}
REFERENCES = ("tensors", "all points")
KEY = ("modes", "selection", "wanted")
_PIECES = 10  # of a run, timed one by one
_STATES = 50  # of each run that the samples are chosen by


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: a full run failed, 2: bad input."""
    return command("sampled_rom", __doc__, _arguments, _run, argv, json="sampled_rom_{scale}.json")


def _arguments(add) -> None:
    add("--scale", choices=SCALES, default="small", help="size of the runs (default: small)")
    add("--resolution", type=positive_int, metavar="N", help="instead of the scale's")
    add("--end-time", type=positive_float, default=1.0, metavar="T", help="[s] (default: 1)")
    add("--reynolds", type=float, choices=TRAINED_ON, default=150.0, metavar="RE",
        help="to run at, one of those trained on (default: 150)")  # fmt: skip
    add("--modes", type=positive_int, nargs="+", default=[5, 10], metavar="M",
        help="numbers of modes (default: 5 10)")  # fmt: skip
    add("--samples", type=positive_int, nargs="+", default=[10, 20, 50, 100], metavar="P",
        help="numbers of samples beside M itself (default: 10 20 50 100)")  # fmt: skip
    add("--out", type=Path, metavar="DIR",
        help="where runs are kept (default: out/tensor-rom-SCALE)")  # fmt: skip


def _wanted(options, modes: int) -> list[tuple[int, str, int | None]]:
    counts = sorted({modes, *options.samples})
    cases = [(modes, name, None) for name in REFERENCES]
    return cases + [(modes, name, count) for count, name in product(counts, SELECTIONS)]


def _run(options) -> None:
    settings = {
        name: getattr(options, name) for name in ("scale", "resolution", "end_time", "reynolds")
    }
    kept = Table(options.json, KEY, settings=settings)
    offline = kept.results.setdefault("offline", [])
    left = {m: [c for c in _wanted(options, m) if not kept.has(c)] for m in options.modes}
    if not any(left.values()):
        tell("all done before")
        return print(_table(kept.results))
    folder = options.out or Path("out", f"tensor-rom-{options.scale}")
    scenes = {reynolds: make_scene(options, reynolds) for reynolds in TRAINED_ON}
    runs = {re: full_run(folder / "full", scene, progress) for re, scene in scenes.items()}
    scene, run = scenes[options.reynolds], runs[options.reynolds]
    largest = train(scene, list(runs.values()), max(options.modes))
    mapped = {re: mapped_run(largest.reference, run, scene.fluid) for re, run in runs.items()}
    rates = EulerianRates.of_scene(scene, largest.reference.points)
    kept.results |= {
        "particles": run.particles,
        "points": len(rates.points),
        "fom_seconds": run.timing.seconds(scene.steps),
        "full_rates_ms": 1e3 * _seconds_of_rates(rates),
        "steps": scene.steps,
        "parameters": scene.parameters,
        "trained_on": TRAINED_ON,
        "device": jax.devices()[0].device_kind,
        "environment": environment(),
    }
    line = centre_line(scene.space)
    truth = probe(run, line, scene.space)
    for modes in (m for m in options.modes if left[m]):
        flow = largest.truncated(modes)
        projected = {re: np.asarray(flow.project(fields)) for re, fields in mapped.items()}
        first = jnp.asarray(projected[options.reynolds][0])

        def profile(coordinates, flow=flow):
            fields = flow.fields(jnp.asarray(coordinates), run.time, line)
            return np.linalg.norm(fields.velocity, axis=2), fields.pressure

        floor = discrepancies("floor_", truth, profile(projected[options.reynolds]))
        start = clock.perf_counter()
        visited = [_visited(1.0 / re, runs[re].time, projected[re]) for re in TRAINED_ON]
        modes_of_rates = rate_basis(rates, flow.basis, visited)
        seconds = clock.perf_counter() - start
        offline.append({
            "modes": modes, "rate_modes": modes_of_rates.size, "rate_basis_s": seconds
        })  # fmt: skip
        viscosity = jnp.asarray(1.0 / options.reynolds)
        for case in left[modes]:
            row = dict(zip(KEY, case, strict=True))
            start = clock.perf_counter()
            if row["selection"] == "tensors":
                model = PointsModel(flow.system, viscosity)
            elif row["selection"] == "all points":
                model = _on_all_points(rates, flow.basis, viscosity)
            else:
                sampling = SELECTIONS[row["selection"]](row["wanted"])
                samples = sampling.choose(flow.basis, modes_of_rates)
                rates_there = SampledRates.of_samples(rates, flow.basis, samples)
                model = PointsModel(rates_there, viscosity)
            row["offline_s"] = clock.perf_counter() - start
            if row["selection"] != "tensors":
                there = model.dynamics
                row |= {"samples": there.gather.shape[1], "members": len(there.modes)}
            found, online = _integrated(model, first, scene, len(run.time) - 1)
            row |= online | floor
            if row["stable"]:
                row |= discrepancies("", truth, profile(np.concatenate([first[None], found])))
            kept.add(row)
            tell(f"M = {modes}, {row['selection']}, {row.get('samples', '-')} samples")
    print(_table(kept.results))


def _visited(viscosity: float, time, coordinates) -> VisitedStates:
    """Some of a run's states, evenly spread."""
    some = np.unique(np.linspace(0, len(time) - 1, _STATES).round().astype(int))
    return VisitedStates(viscosity, time[some], coordinates[some])


def _on_all_points(rates: EulerianRates, basis, viscosity) -> PointsModel:
    tested = np.moveaxis(basis.modes * np.asarray(basis.weights)[None, :, None], 2, 0)
    everywhere = Chosen(np.arange(len(rates.points)), tested)
    return PointsModel(SampledRates.of_samples(rates, basis, everywhere), viscosity)


def _integrated(model: Model, first, scene, snapshots: int):
    """Coordinates after each interval; whether all are good, and compile and run times [s].

    The run is made in pieces. The time it takes without load is estimated by the fastest of them.
    """
    pieces = _PIECES if snapshots % _PIECES == 0 else 1
    intervals = snapshots // pieces

    def run(model, coordinates, first_step):
        step = jnp.asarray(scene.time_step)
        return integrate(model, coordinates, first_step, step, scene.steps_per_snapshot, intervals)

    steps = [jnp.asarray(k * scene.steps_per_snapshot * intervals, jnp.int32)
             for k in range(pieces)]  # fmt: skip
    start = clock.perf_counter()
    program = eqx.filter_jit(run).lower(model, first, steps[0]).compile()
    compiled = clock.perf_counter() - start
    state, stable, found, seconds = first, True, [], []
    for first_step in steps:
        start = clock.perf_counter()
        state, fault, piece, _ = jax.block_until_ready(program(model, state, first_step))
        seconds.append(clock.perf_counter() - start)
        found.append(np.asarray(piece))
        stable = stable and int(fault.code) == 0
    row = {
        "stable": stable,
        "compile_seconds": compiled,
        "rom_seconds": sum(seconds),
        "rom_seconds_by_fastest_piece": pieces * min(seconds),
    }
    return np.concatenate(found), row


def _seconds_of_rates(rates: EulerianRates) -> float:
    """Least time [s] of one evaluation on all points."""
    fields = (
        jnp.zeros((len(rates.points), 1 + rates.points.shape[1]))
        .at[:, 0]
        .set(rates.functional.fluid.reference_density)
    )
    evaluate = eqx.filter_jit(rates)
    seconds = []
    for _ in range(6):
        start = clock.perf_counter()
        jax.block_until_ready(evaluate(jnp.zeros(()), fields, jnp.asarray(0.01)))
        seconds.append(clock.perf_counter() - start)
    return min(seconds[1:])


def _table(results: dict[str, Any]) -> str:
    header = ("M", "selection", "samples", "points read", "velocity %", "floor", "pressure %",
              "median", "floor", "median", "online s", "stable")  # fmt: skip
    rows = []
    for row in results["rows"]:
        rows.append((
            str(row["modes"]), row["selection"], str(row.get("samples", "-")),
            str(row.get("members", "-")),
            *(number(row.get(name)) for name in (
                "velocity_peak_percent", "floor_velocity_peak_percent", "pressure_peak_percent",
                "pressure_median_percent", "floor_pressure_peak_percent",
                "floor_pressure_median_percent", "rom_seconds_by_fastest_piece")),
            "yes" if row["stable"] else "no",
        ))  # fmt: skip
    return (
        f"peak discrepancy on the centre line, {results['points']} reference points, "
        f"full model {results['fom_seconds']:.3g} s\n" + format_rows(header, rows)
    )


if __name__ == "__main__":
    raise SystemExit(main())
