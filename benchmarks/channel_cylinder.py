"""Drag and lift of a cylinder in a channel, Schaefer and Turek's 2D-1, at several resolutions.

    python -m benchmarks.channel_cylinder --resolutions 33 41 66

Means of the coefficients over the second half of each run, of every stage of every step; how they
deviate from few steps to few steps, and how well their mean is known, by the spread of eight parts
of that time; means of the pressure before the cylinder less that behind it; and by how much the
mass flux along the channel is off at the worst of its sections. Every finished run's row is in the
JSON file at once; the same command goes on where it was cut short.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from jaxsph import run_scene
from jaxsph.cli import positive_float, positive_int
from jaxsph.environment import environment
from jaxsph.interpolation import MovingLeastSquaresMap
from jaxsph.scenes import channel_cylinder
from jaxsph.scenes.channel_cylinder import CYLINDER, DIAMETER, HEIGHT, LENGTH, MEAN
from jaxsph.scenes.composed import GHOSTS

from .measure import format_rows, number, progress
from .table import Table, command

KEY = ("resolution", "ghosts", "ends", "h_over_dx", "mach", "end_time")
LITERATURE = {  # at Re = 20; pascals
    "drag": (5.57, 5.59), "lift": (0.0104, 0.0110), "pressure_difference": (0.1172, 0.1176)
}  # fmt: skip
SECTIONS = 11  # of the channel
EACH = 5  # steps over which forces are means, or fewer
BLOCKS = 8  # parts of the second half


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 2: bad input."""
    return command("channel_cylinder", __doc__, _arguments, _run, argv)


def _arguments(add) -> None:
    add("--resolutions", type=positive_int, nargs="+", default=[33, 41, 66], metavar="N",
        help="particles across the channel, 4.1 times those across the cylinder")  # fmt: skip
    add("--ghosts", choices=GHOSTS, default="rows", help="of the cylinder (default: rows)")
    add("--ends", choices=("fringe", "openings"), default="fringe", help="default: fringe")
    add("--h-over-dx", type=positive_float, default=1.5, metavar="X", help="default: 1.5")
    add("--mach", type=positive_float, default=0.1, metavar="M", help="default: 0.1")
    add("--t-end", type=positive_float, default=5.0, metavar="T", help="default: 5 s")


def _run(options) -> None:
    kept = Table(options.json, KEY, beside=lambda rows: {"literature": LITERATURE})
    shared = (options.ghosts, options.ends, options.h_over_dx, options.mach, options.t_end)
    cases = (dict(zip(KEY, (n, *shared), strict=True)) for n in options.resolutions)
    for case in kept.left(cases):
        kept.add(case | run(case))
    head = ("resolution", "ghosts", "ends", "across D", "drag", "+-", "lift", "+-", "dp [Pa]",
            "flux %", "seconds")  # fmt: skip
    names = ("across_cylinder", "drag", "drag_deviation", "lift", "lift_deviation",
             "pressure_difference", "mass_flux_off_percent", "seconds")  # fmt: skip
    rows = [
        (str(r["resolution"]), r["ghosts"], r["ends"], *(number(r[name], 4) for name in names))
        for r in kept.rows
    ]
    print(format_rows(head, rows))


def run(case: dict[str, Any]) -> dict[str, Any]:
    """Coefficients, and what they took."""
    scene = channel_cylinder(
        case["resolution"],
        ghosts=case["ghosts"],
        ends=case["ends"],
        h_over_dx=case["h_over_dx"],
        mach=case["mach"],
        end_time=case["end_time"],
    )
    each = max(k for k in range(1, EACH + 1) if scene.steps % k == 0)
    scene = dataclasses.replace(scene, steps_per_snapshot=each)
    with progress(f"{case['resolution']} across", scene.steps) as report:
        trajectory = run_scene(scene, progress=report)
    late = trajectory.time > (0.5 + 1e-9) * trajectory.time[-1]
    coefficients = 2.0 * trajectory.mean_forces["cylinder"][late] / (MEAN**2 * DIAMETER)
    mean, deviation = coefficients.mean(axis=0), coefficients.std(axis=0)
    blocks = [part.mean(axis=0) for part in np.array_split(coefficients, BLOCKS) if len(part)]
    known = np.std(blocks, axis=0) / np.sqrt(len(blocks))
    return {
        "across_cylinder": DIAMETER / scene.space.spacing,
        "drag": float(mean[0]),
        "drag_deviation": float(deviation[0]),
        "drag_known_to": float(known[0]),
        "lift": float(mean[1]),
        "lift_deviation": float(deviation[1]),
        "lift_known_to": float(known[1]),
        "averaged": True,
        "pressure_difference": pressure_difference(scene.space, trajectory, late),
        "mass_flux_off_percent": 100.0 * flux_off(float(scene.mass), trajectory, late),
        "forces_taken": int(late.sum()),
        "fastest": float(np.linalg.norm(trajectory.velocity[-1], axis=1).max()),
        "density_deviation_percent": float(100.0 * np.abs(trajectory.density - 1.0).max()),
        "seconds": trajectory.metadata["run_seconds"],
        "steps": scene.steps,
        "time_step": scene.time_step,
        "particles": trajectory.particles,
        "device": jax.devices()[0].device_kind,
        "environment": environment(),
    }


def pressure_difference(space, trajectory, late) -> float:
    """Mean pressure [Pa] at the cylinder's foremost point less that at its hindmost, by moving
    least squares of the particles there."""
    apart = np.array([[-CYLINDER.radius, 0.0], [CYLINDER.radius, 0.0]])
    points = jnp.asarray(np.asarray(CYLINDER.center) + apart)
    there = eqx.filter_jit(MovingLeastSquaresMap.allocate(points, space))
    found = []
    for k in np.flatnonzero(late):
        pressure = jnp.asarray(trajectory.pressure[k])[:, None]
        active = None if trajectory.active is None else jnp.asarray(trajectory.active[k])
        values, overflow = there(jnp.asarray(trajectory.position[k]), pressure, active)
        found.append(np.nan if overflow else float(values[0, 0] - values[1, 0]))
    return float(np.mean(found))


def flux_off(mass: float, trajectory, late) -> float:
    """The worst section's mean mass flux over rho0 U H, less 1, in size."""
    x, u = trajectory.position[late][..., 0], trajectory.velocity[late][..., 0]
    edges = np.linspace(0.0, LENGTH, SECTIONS + 1)
    total, _ = np.histogram(x.ravel(), edges, weights=u.ravel())
    flux = mass * total / (np.diff(edges) * len(x) * MEAN * HEIGHT)
    return float(np.abs(flux - 1.0).max())


if __name__ == "__main__":
    raise SystemExit(main())
