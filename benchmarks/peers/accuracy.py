"""Error against run time of whole runs: every code with its own integrator and time step."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from jaxsph.arrangements import Packed
from jaxsph.scenes import Scene
from jaxsph.scenes.taylor_green_solution import kinetic_energy

from ..measure import progress
from .speed import leave_out, load_all, make_scene, write_case
from .workers import OURS, Code, Worker, WorkerError, workers

SLICES = 20  # of a run; codes take turns slice by slice, so that all see the same load


def accuracy_rows(
    codes: list[Code], scheme: str, resolution: int, options: argparse.Namespace
) -> list[dict[str, Any]]:
    """Runs of all codes from the same packed particles: seconds, steps and errors at the end."""
    h_over_dx = options.h_over_dx[0]
    scene = make_scene(resolution, h_over_dx, options.reynolds, Packed())
    failed: dict[str, str] = {}
    with workers(codes) as (started, folder):
        case = write_case(folder, scene, scheme, options.end_time, SLICES)
        found = load_all(started, case, failed)
        plans = _prepared(started, failed)
        seconds, faults = _alternate(started, resolution, failed)
        rows = [
            {
                "code": name, "scheme": scheme, "resolution": resolution, "h_over_dx": h_over_dx,
                "seconds": seconds[name]["seconds"], "busy_seconds": seconds[name]["busy"],
                "steps": SLICES * plans[name]["steps"], "time_step": plans[name]["time_step"],
                "right_hand_sides": SLICES * plans[name]["steps"]
                * found[name]["right_hand_sides_per_step"],
                "terms": found[name]["terms"], "integrator": found[name]["integrator"],
                "time_step_rule": found[name]["time_step_rule"], "fault": faults.get(name),
                **({} if name in faults else _errors(worker, folder, scene, options.end_time)),
            }
            for name, worker in started.items()
        ]  # fmt: skip
    return rows + [
        {"code": name, "scheme": scheme, "resolution": resolution, "fault": reason}
        for name, reason in failed.items()
    ]


def _prepared(started: dict[str, Worker], failed: dict[str, str]) -> dict[str, dict]:
    plans = {}
    for name, worker in list(started.items()):
        try:
            plans[name] = worker.ask("prepare")
        except WorkerError as error:
            leave_out(started, name, error, failed)
    return plans


def _alternate(started: dict[str, Worker], resolution: int, failed: dict[str, str]):
    """Seconds of each code's run, and the faults by which runs ended early."""
    totals = {name: {"seconds": 0.0, "busy": 0.0} for name in started}
    faults: dict[str, str] = {}
    with progress(f"runs at {resolution}", SLICES) as report:
        for _ in range(SLICES):
            for name, worker in list(started.items()):
                if name in faults:
                    continue
                try:
                    reply = worker.ask("advance")
                except WorkerError as error:
                    leave_out(started, name, error, failed)
                    continue
                for kind in totals[name]:
                    totals[name][kind] += reply[kind]
                if reply["fault"] is not None:
                    faults[name] = reply["fault"]
            report(1)
    return totals, faults


def _errors(worker: Worker, folder: Path, scene: Scene, time: float) -> dict[str, float]:
    """Of velocity and pressure at the particles where they then are, and of kinetic energy.

    Root mean squares over those of the exact solution, in percent; pressures less their mean.
    """
    path = folder / "state.npz"
    worker.ask("state", path=str(path))
    with np.load(path) as arrays:
        position, velocity, pressure = (arrays[k] for k in ("position", "velocity", "pressure"))
    exact_velocity, exact_pressure = map(np.asarray, scene.exact(position, time))
    density = float(scene.fluid.reference_density)
    exact_energy = float(kinetic_energy(time, scene.exact.viscosity, density))
    energy = 0.5 * float(scene.mass) * float((velocity**2).sum())
    norm = np.linalg.norm
    apart = pressure - pressure.mean() - (exact_pressure - exact_pressure.mean())
    return {
        "velocity_error_percent": 100.0 * norm(velocity - exact_velocity) / norm(exact_velocity),
        "pressure_error_percent": 100.0 * norm(apart) / norm(exact_pressure),
        "kinetic_energy_error_percent": 100.0 * (energy / exact_energy - 1.0),
    }


def at_equal_time(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """For each peer's run, this library's velocity error in the same time, and time to its error.

    Along the polyline of log error over log time through this library's runs of the scheme.
    Outside of it the nearest run counts, and `bound` says so: its error is then an upper bound
    of what the time would give, or its time of what the error would take.
    """
    compared = []
    for row in rows:
        error = row.get("velocity_error_percent", np.nan)
        mine = _own_runs(rows, row["scheme"])
        if row["code"] == OURS or not np.isfinite(error) or not mine:
            continue
        seconds, errors = (np.asarray(column) for column in zip(*mine, strict=True))
        reached = _interpolated(row["seconds"], seconds, errors)
        needed = _interpolated(error, errors[::-1], seconds[::-1])
        compared.append({
            "code": row["code"],
            "scheme": row["scheme"],
            "resolution": row["resolution"],
            "seconds": row["seconds"],
            "velocity_error_percent": error,
            "our_error_percent_in_that_time": reached,
            "error_bound": bool(row["seconds"] > seconds[-1] or row["seconds"] < seconds[0]),
            "our_seconds_for_that_error": needed,
            "seconds_bound": bool(error > errors[0] or error < errors[-1]),
            "error_ratio": error / reached,
            "time_ratio": row["seconds"] / needed,
        })  # fmt: skip
    return compared


def _own_runs(rows, scheme: str) -> list[tuple[float, float]]:
    """Seconds and errors of this library's runs, only those that are better than all faster."""
    runs = sorted(
        (row["seconds"], row["velocity_error_percent"])
        for row in rows
        if row["code"] == OURS and row["scheme"] == scheme and row["fault"] is None
    )
    best: list[tuple[float, float]] = []
    for seconds, error in runs:
        if not best or error < best[-1][1]:
            best.append((seconds, error))
    return best


def _interpolated(at: float, x: np.ndarray, y: np.ndarray) -> float:
    """Linear in logarithms, constant beyond the ends."""
    return float(np.exp(np.interp(np.log(at), np.log(x), np.log(y))))
