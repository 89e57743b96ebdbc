"""Flows between walls with exact solutions: Couette, Poiseuille, water at rest; error beside time.

    python -m benchmarks.plane_flows --resolutions 25 50 100

Couette and Poiseuille flow from rest at Re = 10 against their series, relative L2 errors at times
from 0.25 s to the end; the tank against hydrostatic pressure. Every finished run's row is in the
JSON file at once; the same command goes on where it was cut short.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import jax
import numpy as np

from jaxsph import Trajectory, run_scene
from jaxsph.arrangements import JitteredLattice, Lattice
from jaxsph.cli import positive_float, positive_int
from jaxsph.effects import FixedWallVelocity, NoSlip
from jaxsph.environment import environment
from jaxsph.scenes import Scene, couette, hydrostatic_tank, poiseuille
from jaxsph.scenes import plane_flow_solution as exact
from jaxsph.scenes.hydrostatic_tank import GRAVITY, REFERENCE_DENSITY, hydrostatic_pressure
from jaxsph.schemes import DeltaPlus

from .measure import format_rows, number, progress, tell
from .table import Table, command

REYNOLDS = 10.0
SNAPSHOTS = 40
KEY = ("flow", "resolution", "h_over_dx", "arrangement", "wall_velocity", "layers", "end_time")
ARRANGEMENTS = {"lattice": Lattice(), "jittered": JitteredLattice(amplitude=0.25)}
WALLS = {"no-slip": NoSlip(), "fixed": FixedWallVelocity()}


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 2: bad input."""
    return command("plane_flows", __doc__, _arguments, _run, argv)


def _run(options) -> None:
    kept = Table(options.json, KEY, beside=_beside)
    for case in kept.left(_cases(options)):
        kept.add(case | run(case))
    print(_table(kept.rows))
    for order in _orders(kept.rows):
        tell(f"order: {order}")


def _arguments(add) -> None:
    add("--resolutions", type=positive_int, nargs="+", default=[25, 50, 100], metavar="N",
        help="particles across (default: 25 50 100)")  # fmt: skip
    add("--flows", choices=("couette", "poiseuille", "hydrostatic-tank"), nargs="+",
        default=["couette", "poiseuille", "hydrostatic-tank"], help="default: all")  # fmt: skip
    add("--arrangements", choices=tuple(ARRANGEMENTS), nargs="+", default=["jittered"],
        help="of the two channels; the tank starts on a lattice (default: jittered)")  # fmt: skip
    add("--walls", choices=tuple(WALLS), nargs="+", default=["no-slip"],
        help="readings of a wall's velocity (default: no-slip)")  # fmt: skip
    add("--layers", type=positive_int, nargs="+", default=[4], metavar="K",
        help="of ghosts; 4 fill the support at h = 2 dx (default: 4)")  # fmt: skip
    add("--h-over-dx", type=positive_float, default=2.0, metavar="X", help="default: 2")


def _cases(options):
    for flow in options.flows:
        tank = flow == "hydrostatic-tank"
        for resolution in options.resolutions:
            for arrangement in ("lattice",) if tank else options.arrangements:
                for wall in ("no-slip",) if tank else options.walls:
                    for layers in options.layers:
                        end = 10.0 if tank else 2.0
                        values = (
                            flow, resolution, options.h_over_dx, arrangement, wall, layers, end
                        )  # fmt: skip
                        yield dict(zip(KEY, values, strict=True))


def make_scene(case: dict[str, Any]) -> Scene:
    """The scene of a case, with `SNAPSHOTS` snapshots or a few more."""
    settings = {
        "h_over_dx": case["h_over_dx"],
        "end_time": case["end_time"],
        "layers": case["layers"],
        "scheme": DeltaPlus(),
    }
    if case["flow"] == "hydrostatic-tank":
        scene = hydrostatic_tank(case["resolution"], **settings)
    else:
        make = {"couette": couette, "poiseuille": poiseuille}[case["flow"]]
        arrangement, wall = ARRANGEMENTS[case["arrangement"]], WALLS[case["wall_velocity"]]
        scene = make(
            case["resolution"], REYNOLDS, arrangement=arrangement, wall_velocity=wall, **settings
        )
    each = max(k for k in range(1, scene.steps // SNAPSHOTS + 1) if scene.steps % k == 0)
    return dataclasses.replace(scene, steps_per_snapshot=each)


def run(case: dict[str, Any]) -> dict[str, Any]:
    """Errors and times of one run."""
    scene = make_scene(case)
    with progress(case["flow"], scene.steps) as report:
        trajectory = run_scene(scene, progress=report)
    errors = _tank_errors if case["flow"] == "hydrostatic-tank" else _channel_errors
    distance = -np.asarray(jax.vmap(scene.walls.fluid_region.signed_distance)(trajectory.position))
    return {
        **errors(case, scene, trajectory),
        "nearest_to_wall_over_dx": float(distance.min() / scene.space.spacing),
        "largest_density_deviation_percent": _deviation(scene, trajectory),
        "seconds": trajectory.timing.run_seconds,
        "compile_seconds": trajectory.timing.compile_seconds,
        "steps": scene.steps,
        "time_step": scene.time_step,
        "dx": scene.space.spacing,
        "particles": trajectory.particles,
        "ghosts": scene.walls.position.shape[0],
        "device": jax.devices()[0].device_kind,
        "environment": environment(),
    }


def _deviation(scene: Scene, trajectory: Trajectory) -> float:
    reference = float(scene.fluid.reference_density)
    return float(100.0 * np.abs(trajectory.density / reference - 1.0).max())


def _channel_errors(case, scene: Scene, trajectory: Trajectory) -> dict[str, Any]:
    """Relative L2 error of the velocity along the channel over all particles, from 0.25 s on.

    The velocity across, zero in theory, is told apart: it is what the start's jitter leaves.
    """
    viscosity = 1.0 / REYNOLDS
    found, across = {}, {}
    for time in (0.25, 0.5, 1.0, case["end_time"]):
        k = trajectory.nearest(time)
        height, at = trajectory.position[k][:, 1], float(trajectory.time[k])
        if case["flow"] == "couette":
            along = exact.couette(height, at, viscosity)
        else:
            along = exact.poiseuille(height, at, viscosity, 8.0 * viscosity)
        velocity, size = trajectory.velocity[k], np.linalg.norm(along)
        found[f"{at:g}"] = float(100.0 * np.linalg.norm(velocity[:, 0] - along) / size)
        across[f"{at:g}"] = float(100.0 * np.linalg.norm(velocity[:, 1]) / size)
    return {
        "velocity_error_percent_at": found,
        "velocity_error_percent": max(found.values()),
        "cross_flow_percent_at": across,
    }


def _tank_errors(case, scene: Scene, trajectory: Trajectory) -> dict[str, Any]:
    """Pressure against rho0 g (H - y) over rho0 g H; speed over c0; how far particles drift."""
    scale = REFERENCE_DENSITY * GRAVITY
    error = trajectory.pressure[-1] - np.asarray(hydrostatic_pressure(trajectory.position[-1]))
    speed = np.linalg.norm(trajectory.velocity[-1], axis=1)
    moved = np.linalg.norm(trajectory.position[-1] - trajectory.position[0], axis=1)
    later = np.linalg.norm(
        trajectory.position[-1] - trajectory.position[len(trajectory.time) // 2], axis=1
    )
    return {
        "pressure_error_percent": float(100.0 * np.abs(error).max() / scale),
        "pressure_error_rms_percent": float(100.0 * np.sqrt((error**2).mean()) / scale),
        "pressure_offset_percent": float(100.0 * error.mean() / scale),
        "speed_over_sound_speed": float(speed.max() / float(scene.fluid.sound_speed)),
        "largest_way_over_dx": float(moved.max() / scene.space.spacing),
        "largest_way_in_second_half_over_dx": float(later.max() / scene.space.spacing),
        "mean_height_change_over_dx": float(
            (trajectory.position[-1] - trajectory.position[0])[:, 1].mean() / scene.space.spacing
        ),
    }


def _orders(rows) -> list[dict[str, Any]]:
    """Slope of log error over log dx, fitted by least squares, of runs alike but for dx."""
    groups: dict[tuple, list] = {}
    for row in rows:
        name = "pressure_error_percent" if "tank" in row["flow"] else "velocity_error_percent"
        key = tuple(row[k] for k in KEY if k != "resolution")
        groups.setdefault(key, []).append((row["dx"], row[name]))
    orders = []
    for key, points in groups.items():
        if len(points) > 1:
            logs = np.log(np.asarray(points))
            names = [k for k in KEY if k != "resolution"]
            slope = float(np.polyfit(logs[:, 0], logs[:, 1], 1)[0])
            orders.append(dict(zip(names, key, strict=True)) | {"order": slope})
    return orders


def _beside(rows) -> dict[str, Any]:
    return {"reynolds": REYNOLDS, "orders": _orders(rows)}


def _table(rows) -> str:
    header = ("flow", "across", "start", "walls", "layers", "error %", "nearest/dx", "run s")
    cells = []
    for row in rows:
        error = row.get("velocity_error_percent", row.get("pressure_error_percent"))
        cells.append((
            row["flow"], str(row["resolution"]), row["arrangement"], row["wall_velocity"],
            str(row["layers"]), number(error), number(row["nearest_to_wall_over_dx"]),
            number(row["seconds"]),
        ))  # fmt: skip
    return format_rows(header, cells)


if __name__ == "__main__":
    raise SystemExit(main())
