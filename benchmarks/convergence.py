"""Accuracy of the full model on the Taylor-Green vortex, with its order and its time.

    python -m benchmarks.convergence --resolutions 25 50 100 --json FILE

Relative errors against the exact solution at the end of the run, and what is conserved. Every
finished run's row is in the JSON file at once; the same command goes on where it was cut short.
"""

from __future__ import annotations

import dataclasses
import math
import time as clock
from itertools import product
from typing import Any

import jax
import numpy as np

from jaxsph import SimulationError, Trajectory, simulate
from jaxsph.arrangements import Lattice
from jaxsph.cli import ARRANGEMENTS, positive_float, positive_int
from jaxsph.effects import ParticleShifting, ShiftingTransport
from jaxsph.environment import environment
from jaxsph.metrics import kinetic_energy
from jaxsph.scenes import Scene, taylor_green
from jaxsph.scenes.taylor_green_solution import kinetic_energy as exact_energy
from jaxsph.schemes import DeltaPlus

from .measure import (
    format_rows,
    interacting_pairs,
    number,
    progress,
    summary,
)
from .table import Table, command

SNAPSHOTS = 20  # of a run: enough to see the largest drift, and times of as many parts
ERRORS = ("kinetic_energy_error", "velocity_error", "pressure_error")
KEY = ("resolution", "h_over_dx", "reynolds", "end_time", "arrangement", "precision", "shifting")
_MARGIN = 1.15  # room in the neighbour list over its need at the start, the library's own
_MARGIN_WITHOUT_SHIFTING = 3.0  # particles then gather along streamlines
MASS_CHECK = (
    "particle masses are constants and no particle is added or lost: the number of particles with "
    "finite fields in the last snapshot times the particle mass, against rho0 times the area"
)


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 2: bad input."""
    return command("convergence", __doc__, _arguments, _run, argv)


def _run(options) -> None:
    kept = Table(options.json, KEY, beside=_beside)
    wanted = [dict(zip(KEY, values, strict=True)) for values in _cases(options)]
    for case in kept.left(wanted):
        with jax.enable_x64(case["precision"] == "float64"):
            kept.add(case | run(case))
    shown = [row for row in kept.rows if {name: row[name] for name in KEY} in wanted]
    print(_table(shown))
    for order in _orders(shown):
        slopes = ", ".join(f"{name} {number(order[name])}" for name in ERRORS)
        print(f"order, {order['precision']}, {order['arrangement']}: {slopes}")


def _arguments(add) -> None:
    add("--resolutions", type=positive_int, nargs="+", default=[25, 50, 100], metavar="N",
        help="particles per side (default: 25 50 100)")  # fmt: skip
    add("--h-over-dx", type=positive_float, default=2.0, metavar="X", help="default: %(default)g")
    add("--reynolds", type=positive_float, default=100.0, metavar="RE", help="default: 100")
    add("--end-time", type=positive_float, default=1.0, metavar="T", help="[s] (default: 1)")
    add("--arrangement", choices=tuple(ARRANGEMENTS), default="packed",
        help="how particles start (default: %(default)s)")  # fmt: skip
    add("--precisions", choices=("float32", "float64"), nargs="+", default=["float64"],
        help="default: float64")  # fmt: skip
    add("--skip-without-shifting", action="store_true",
        help="leave out the runs without the two shifting effects")  # fmt: skip


def _cases(options):
    """Values of `KEY`, in the order in which they are run."""
    shifting = (True,) if options.skip_without_shifting else (True, False)
    for on, precision, resolution in product(shifting, options.precisions, options.resolutions):
        same = (options.h_over_dx, options.reynolds, options.end_time, options.arrangement)
        yield (resolution, *same, precision, on)


def run(case: dict[str, Any]) -> dict[str, Any]:
    """Errors and times of one run; of one that fails, what it conserved until then."""
    scene = make_scene(case)
    margin = _MARGIN if case["shifting"] else _MARGIN_WITHOUT_SHIFTING
    marks, fault = [], None
    with progress(f"{case['resolution']} x {case['resolution']}", scene.steps) as report:

        def mark(steps):
            marks.append(clock.perf_counter())
            report(steps)

        try:
            trajectory = simulate(
                scene.model(margin=margin),
                scene.state,
                scene.schedule,
                progress=mark,
            )
        except SimulationError as error:
            fault, trajectory = str(error), error.trajectory
    errors = dict.fromkeys(ERRORS) if fault else _errors(scene, trajectory)
    pairs = interacting_pairs(scene.state.position, scene.space)
    return {
        **errors,
        "momentum_drift": _momentum_drift(trajectory),
        **_conserved(scene, trajectory),
        "fault": fault,
        "until": float(trajectory.time[-1]),
        "seconds": None if fault else trajectory.timing.run_seconds,
        "compile_seconds": trajectory.timing.compile_seconds,
        "seconds_per_step": summary(list(np.diff(marks) / scene.steps_per_snapshot)),
        "steps": scene.steps,
        "time_step": scene.time_step,
        "dx": scene.space.spacing,
        "particles": trajectory.particles,
        "neighbors": pairs / trajectory.particles,
        "dtype": str(trajectory.position.dtype),
        "device": jax.devices()[0].device_kind,
        "environment": environment(),
    }


def make_scene(case: dict[str, Any]) -> Scene:
    """The scene of a case, with `SNAPSHOTS` snapshots and at most its own dt/dx."""

    def make(arrangement, **settings):
        return taylor_green(
            case["resolution"],
            case["reynolds"],
            h_over_dx=case["h_over_dx"],
            end_time=case["end_time"],
            arrangement=arrangement,
            scheme=DeltaPlus(),
            dtype=case["precision"],
            **settings,
        )

    each = math.ceil(make(Lattice()).steps / SNAPSHOTS)
    time_step = case["end_time"] / (each * SNAPSHOTS)
    scene = make(ARRANGEMENTS[case["arrangement"]](seed=0), time_step=time_step)
    effects = scene.effects
    if not case["shifting"]:
        shifting = ParticleShifting | ShiftingTransport
        effects = tuple(effect for effect in effects if not isinstance(effect, shifting))
    # numerical effects alone are left out, so the flow stays the same
    return dataclasses.replace(
        scene, effects=effects, steps_per_snapshot=each, solution=scene.exact
    )


def _errors(scene: Scene, trajectory: Trajectory) -> dict[str, float]:
    """Relative errors at the end, over the particles: energy, and L2 of velocity and pressure."""
    time, rho = float(trajectory.time[-1]), float(scene.fluid.reference_density)
    position, velocity, pressure = (
        np.asarray(field[-1], np.float64)
        for field in (trajectory.position, trajectory.velocity, trajectory.pressure)
    )
    energy = float(exact_energy(time, scene.exact.viscosity, rho))
    found = float(kinetic_energy(velocity, float(scene.mass)))
    true_velocity, true_pressure = map(np.asarray, scene.exact(position, time))
    return {
        "kinetic_energy_error": abs(found - energy) / energy,
        "velocity_error": _relative(velocity, true_velocity),
        "pressure_error": _relative(
            pressure - pressure.mean(), true_pressure - true_pressure.mean()
        ),
    }


def _relative(found: np.ndarray, true: np.ndarray) -> float:
    return float(np.linalg.norm(found - true) / np.linalg.norm(true))


def _momentum_drift(trajectory: Trajectory) -> float:
    """Largest change of the momentum per unit mass over U = 1 m/s, all masses being equal."""
    momentum = np.mean(np.asarray(trajectory.velocity, np.float64), axis=1)
    return float(np.linalg.norm(momentum - momentum[0], axis=1).max())


def _conserved(scene: Scene, trajectory: Trajectory) -> dict[str, Any]:
    """Error of the total mass, and of the volume sum_i m / rho_i at the end, both relative."""
    density = np.asarray(trajectory.density[-1], np.float64)
    finite = np.isfinite(density) & np.isfinite(trajectory.position[-1]).all(axis=1)
    mass, volume = float(scene.mass), scene.space.box.volume
    expected = float(scene.fluid.reference_density) * volume
    return {
        "mass_error": abs(mass * int(finite.sum()) - expected) / expected,
        "mass_check": MASS_CHECK,
        "volume_error": abs(float((mass / density).sum()) - volume) / volume,
    }


def _orders(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Slopes of log error over log dx, fitted by least squares, of runs alike but for dx."""
    groups: dict[tuple, list[dict[str, Any]]] = {}
    for row in rows:
        groups.setdefault(tuple(row[name] for name in KEY[1:]), []).append(row)
    orders = []
    for values, group in groups.items():
        order: dict[str, Any] = dict(zip(KEY[1:], values, strict=True))
        good = [row for row in group if row["fault"] is None]
        if not order["shifting"] or len({row["resolution"] for row in good}) < 2:
            continue  # without shifting, errors tell of holes between particles
        logs = np.log([row["dx"] for row in good])
        for name in ERRORS:
            order[name] = float(np.polyfit(logs, np.log([row[name] for row in good]), 1)[0])
        orders.append(order | {"resolutions": sorted(row["resolution"] for row in good)})
    return orders


def _beside(rows: list[dict[str, Any]]) -> dict[str, Any]:
    return {"orders": _orders(rows), "environment": environment()}


def _table(rows: list[dict[str, Any]]) -> str:
    header = ("side", "dtype", "shifting", "energy %", "velocity %", "pressure %", "momentum",
              "mass", "run s", "until s")  # fmt: skip
    cells = []
    for row in rows:
        percent = (None if row[name] is None else 100.0 * row[name] for name in ERRORS)
        cells.append((
            str(row["resolution"]),
            row["dtype"],
            "yes" if row["shifting"] else "no",
            *(number(value) for value in percent),
            number(row["momentum_drift"], 2),
            number(row["mass_error"], 2),
            number(row["seconds"]),
            number(row["until"]) + (" (fault)" if row["fault"] else ""),
        ))  # fmt: skip
    return format_rows(header, cells)


if __name__ == "__main__":
    raise SystemExit(main())
