"""Reduced models on reference points at larger steps: RK4, adaptive explicit and implicit solvers.

    python -m benchmarks.larger_steps --scale small

The Taylor-Green vortex as in `benchmarks.tensor_rom`, without closure. RK4 takes the full model's
step and multiples of it; diffrax's solvers choose theirs by a tolerance. All are judged at the same
times, a longest step of RK4 apart: against the system's own solution at a tolerance of 1e-12, and
against the full model on the centre line. Right-hand sides are counted as they are evaluated; a
Jacobian (M tangents) counts as one. Full runs are those of `benchmarks.tensor_rom` if it
has made them, and finished rows stay in the JSON file: the same command goes on.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from jaxsph.cli import SCALES, positive_float, positive_int
from jaxsph.environment import environment
from jaxsph.metrics import centre_line, probe, relative_discrepancy
from jaxsph_rom.points import QuadraticSystem, mapped_run, rollout
from jaxsph_rom.points.dynamics.adaptive import solve
from jaxsph_rom.study import full_run

from .measure import (
    alternate,
    compiled,
    format_rows,
    number,
    progress,
    summary,
    tell,
)
from .reduced_vortex import TRAINED_ON, make_scene, train
from .table import Table, command

SOLVERS = {
    "tsit5": diffrax.Tsit5(),
    "dopri8": diffrax.Dopri8(),
    "kvaerno3": diffrax.Kvaerno3(),
    "kvaerno5": diffrax.Kvaerno5(),
}
TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-6, 1e-8)
_TIGHT = 1e-12
_MAX_STEPS = 16_384
_REPEATS = 20


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: a full run failed, 2: bad input."""
    return command(
        "larger_steps", __doc__, _arguments, _run, argv, json="larger_steps_{scale}.json"
    )


def _arguments(add) -> None:
    add("--scale", choices=SCALES, default="small", help="size of the runs (default: small)")
    add("--resolution", type=positive_int, metavar="N", help="instead of the scale's")
    add("--end-time", type=positive_float, default=1.0, metavar="T", help="[s] (default: 1)")
    add("--reynolds", type=positive_float, default=175.0, metavar="RE",
        help="to run at (default: 175)")  # fmt: skip
    add("--modes", type=positive_int, nargs="+", default=[5, 10, 20], metavar="M",
        help="numbers of modes (default: 5 10 20)")  # fmt: skip
    add("--factors", type=positive_int, nargs="+", default=[1, 2, 4, 8, 16], metavar="K",
        help="RK4's steps over the full model's (default: 1 2 4 8 16)")  # fmt: skip
    add("--out", type=Path, metavar="DIR",
        help="where runs are kept (default: out/tensor-rom-SCALE)")  # fmt: skip


def _run(options) -> None:
    names = ("scale", "resolution", "end_time", "reynolds", "factors")
    settings = {name: getattr(options, name) for name in names}
    kept = Table(options.json, ("modes",), settings=settings)
    left = [m for m in options.modes if not kept.has({"modes": m})]
    if not left:
        tell("all done before")
        return print(_table(kept.results))
    folder = options.out or Path("out", f"tensor-rom-{options.scale}")
    scenes = {re: make_scene(options, re) for re in sorted({*TRAINED_ON, options.reynolds})}
    scene = scenes[options.reynolds]
    stride = max(options.factors)
    if stride % scene.steps_per_snapshot or any(stride % k for k in options.factors):
        raise ValueError(
            f"--factors: the largest, {stride}, must be a multiple of all others and of the "
            f"{scene.steps_per_snapshot} steps between snapshots."
        )
    if stride > scene.steps:
        raise ValueError(f"--factors: {stride} steps are more than the run's {scene.steps}.")
    runs = {re: full_run(folder / "full", scene, progress) for re, scene in scenes.items()}
    flow = train(scenes[TRAINED_ON[0]], [runs[re] for re in TRAINED_ON], max(left))
    run = runs[options.reynolds]
    first = mapped_run(flow.reference, run, scene.fluid)[..., 0]
    judged = slice(None, None, stride // scene.steps_per_snapshot)
    line = centre_line(scene.space)
    truth = tuple(a[judged][1:] for a in probe(run, line, scene.space))
    time = run.time[judged][1:]
    kept.results |= {
        "particles": run.particles,
        "parameters": scene.parameters,
        "trained_on": TRAINED_ON,
        "step": scene.time_step,
        "judged_every": stride * scene.time_step,
        "fom_seconds": run.timing.seconds(scene.steps),
        "device": jax.devices()[0].device_kind,
        "environment": environment(),
    }
    for modes in left:
        part = flow.truncated(modes)

        def percent(coordinates, part=part):
            fields = part.fields(jnp.asarray(coordinates), time, line)
            found = np.linalg.norm(fields.velocity, axis=2), fields.pressure
            return [
                float(relative_discrepancy(a, b).max()) for a, b in zip(truth, found, strict=True)
            ]

        kept.rows.extend(_measured(part, part.project(first), scene, options, time, percent))
        kept.write()
    print(_table(kept.results))


def _measured(flow, start, scene, options, time, percent) -> list[dict[str, Any]]:
    """A row for every method, timed in turn."""
    system, viscosity = flow.system, jnp.asarray(1.0 / options.reynolds, start.dtype)
    time, rows, calls = jnp.asarray(time), [], {}
    exact = jax.jit(_by_tolerance(diffrax.Dopri8()))(
        system, start, viscosity, time, jnp.asarray(_TIGHT)
    )
    exact = np.asarray(exact[0])
    for factor in options.factors:
        each = max(options.factors) // factor
        steps = each * len(time)

        def run(system, start, viscosity, each=each, step=factor * scene.time_step):
            return rollout(system, start, viscosity, step, each, len(time))

        call, seconds = compiled(run, system, start, viscosity)
        calls[f"rk4 x{factor}"] = call
        rows.append({"method": "rk4", "factor": factor, "tolerance": None, "steps": steps})
        rows[-1] |= {"rejected": 0, "evaluations": 4 * steps, "compile_seconds": seconds}
        rows[-1] |= _judged(exact, np.asarray(call()), percent)
    for method, solver in SOLVERS.items():
        run = _by_tolerance(solver)
        arguments = (system, start, viscosity, time, jnp.asarray(TOLERANCES[0]))
        before = clock.perf_counter()
        program = jax.jit(run).lower(*arguments).compile()
        seconds = clock.perf_counter() - before
        counted = _counted(run)
        for tolerance in TOLERANCES:
            arguments = (system, start, viscosity, time, jnp.asarray(tolerance))
            call = partial(_blocking, program, arguments)
            calls[f"{method} {tolerance:g}"] = call
            found, steps, rejected, good = call()
            rows.append({"method": method, "factor": None, "tolerance": tolerance})
            rows[-1] |= {"steps": int(steps), "rejected": int(rejected)}
            rows[-1] |= {"evaluations": counted(*arguments), "compile_seconds": seconds}
            rows[-1] |= _judged(exact, np.asarray(found), percent) | {"stable": bool(good)}
    wall, _ = alternate(calls, _REPEATS)
    for row, name in zip(rows, calls, strict=True):
        row |= {"modes": system.size, "reynolds": options.reynolds, "seconds": summary(wall[name])}
    return rows


def _judged(exact, found, percent) -> dict[str, Any]:
    if not np.isfinite(found).all():
        return {"stable": False}
    error = np.linalg.norm(found - exact, axis=1) / np.linalg.norm(exact, axis=1)
    velocity, pressure = percent(found)
    return {
        "stable": True,
        "error": float(error.max()),
        "velocity_peak_percent": velocity,
        "pressure_peak_percent": pressure,
    }


def _by_tolerance(solver):
    """Coordinates, steps, rejected steps and whether all went well, by system and tolerance."""

    def run(system, start, viscosity, time, tolerance):
        # errors count by the length of the first coordinates, whatever the size of a mode
        scale = tolerance * jnp.linalg.norm(start)
        controller = diffrax.PIDController(rtol=tolerance, atol=scale)
        found = solve(
            system, start, viscosity, time,
            solver=solver, controller=controller, max_steps=_MAX_STEPS,
        )  # fmt: skip
        return found.coordinates, found.steps, found.rejected, found.good

    return run


class _Counted(eqx.Module):
    """A system that reports each of its evaluations."""

    system: QuadraticSystem
    report: Callable = eqx.field(static=True)

    def rates(self, time, coordinates, values):
        jax.debug.callback(self.report, coordinates[0])
        return self.system.rates(time, coordinates, values)


def _counted(run) -> Callable[..., int]:
    """Evaluations of the right-hand side in a run, as a function of its arguments."""
    count = 0

    def report(_):
        nonlocal count
        count += 1

    program = jax.jit(lambda system, *rest: run(_Counted(system, report), *rest))

    def evaluations(*arguments):
        nonlocal count
        count = 0
        jax.block_until_ready(program(*arguments))
        jax.effects_barrier()
        return count

    return evaluations


def _blocking(program, arguments):
    return jax.block_until_ready(program(*arguments))


def _table(results: dict[str, Any]) -> str:
    header = ("M", "method", "step or tolerance", "steps", "rejected", "evaluations", "ms",
              "compile s", "error", "velocity %", "pressure %")  # fmt: skip
    rows = []
    for row in results["rows"]:
        setting = f"{row['factor']} dt" if row["factor"] else f"{row['tolerance']:g}"
        rows.append((
            str(row["modes"]), row["method"], setting,
            *(str(row[name]) for name in ("steps", "rejected", "evaluations")),
            number(1e3 * row["seconds"]["median"]), number(row["compile_seconds"]),
            *(number(row.get(name)) if row["stable"] else "lost" for name in (
                "error", "velocity_peak_percent", "pressure_peak_percent")),
        ))  # fmt: skip
    text = f"largest error at times {results['judged_every']:g} s apart, to the system's own "
    text += f"solution and to the full model; dt = {results['step']:g} s\n"
    return text + format_rows(header, rows)


if __name__ == "__main__":
    raise SystemExit(main())
