"""Torque between two cylinders, of which one turns, against the exact one.

    python -m benchmarks.taylor_couette --resolutions 8 16 32

From the exact flow on, mean torques over the second half of 1 s, by N particles to the inner
cylinder's radius, and how far the mean velocity around is from the exact one. Every finished run's
row is in the JSON file at once; the same command goes on where it was cut short.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from jaxsph import run_scene
from jaxsph.cli import positive_float, positive_int
from jaxsph.environment import environment
from jaxsph.scenes import Scene, taylor_couette
from jaxsph.scenes.composed import GHOSTS
from jaxsph.scenes.taylor_couette import INNER, OUTER, CircularCouetteFlow
from jaxsph.schemes import SCHEMES

from .measure import format_rows, number, progress
from .table import Table, command

KEY = ("scheme", "ghosts", "turns", "resolution", "h_over_dx")
TURN, VISCOSITY, SOUND = 1.0, 0.05, 10.0  # rad/s, m^2/s, m/s
END, SNAPSHOTS = 1.0, 20  # s; five times that in which friction evens a flow out
RINGS = 8


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 2: bad input."""
    return command("taylor_couette", __doc__, _arguments, _run, argv)


def _arguments(add) -> None:
    add("--resolutions", type=positive_int, nargs="+", default=[8, 16, 32], metavar="N",
        help="particles to the inner cylinder's radius")  # fmt: skip
    add("--schemes", choices=tuple(SCHEMES), nargs="+", default=["sharp-at-walls"],
        help="default: sharp-at-walls")  # fmt: skip
    add("--turns", choices=("inner", "outer"), nargs="+", default=["inner", "outer"],
        help="default: one after the other")  # fmt: skip
    add("--ghosts", choices=GHOSTS, default="rows", help="of the walls (default: rows)")
    add("--h-over-dx", type=positive_float, default=2.0, metavar="X", help="default: 2")


def _run(options) -> None:
    kept = Table(options.json, KEY)
    cases = (
        dict(zip(KEY, (scheme, options.ghosts, turns, n, options.h_over_dx), strict=True))
        for n in options.resolutions
        for scheme in options.schemes
        for turns in options.turns
    )
    for case in kept.left(cases):
        kept.add(case | run(case))
    names = ("scheme", "ghosts", "turns", "h_over_dx", "resolution")
    found = ("inner_torque_error_percent", "outer_torque_error_percent", "velocity_error_percent")
    rows = [(*(str(r[n]) for n in names), *(number(r[n], 3) for n in found)) for r in kept.rows]
    print(format_rows((*names, "inner %", "outer %", "velocity %"), rows))


def run(case: dict[str, Any]) -> dict[str, Any]:
    """Errors of mean torques and of the mean velocity around, and what they took."""
    scene, flow = annulus(case)
    with progress(f"{case['resolution']} to the radius", scene.steps) as report:
        trajectory = run_scene(scene, progress=report)
    late = trajectory.time > 0.5 * END + 1e-9
    exact = flow.torque(VISCOSITY)
    errors = {
        f"{name}_torque_error_percent": float(
            100.0 * (sign * trajectory.mean_torques[name][late].mean() / exact - 1.0)
        )
        for name, sign in (("inner", 1.0), ("outer", -1.0))
    }
    return errors | {
        "exact_torque": -exact,
        "velocity_error_percent": profile_error(trajectory, late, flow),
        "seconds": trajectory.metadata["run_seconds"],
        "steps": scene.steps,
        "particles": trajectory.particles,
        "environment": environment(),
    }


def profile_error(trajectory, late, flow) -> float:
    """Mean velocity around in rings, off the exact one in root mean square, in percent of that."""
    position, velocity = trajectory.position[late], trajectory.velocity[late]
    radius = np.linalg.norm(position, axis=2)
    speed = position[..., 0] * velocity[..., 1] - position[..., 1] * velocity[..., 0]
    a, b = flow.coefficients
    exact = a * radius + b / radius
    edges = np.linspace(INNER, OUTER, RINGS + 1)
    found, expected = (
        np.histogram(radius, edges, weights=each)[0] for each in (speed / radius, exact)
    )
    return float(100.0 * np.linalg.norm(found - expected) / np.linalg.norm(expected))


def annulus(case: dict[str, Any]) -> tuple[Scene, CircularCouetteFlow]:
    """The scene, which starts with its exact flow, and that flow."""
    turns = {"inner": 0.0, "outer": 0.0} | {case["turns"]: TURN}
    radius = {"inner": INNER, "outer": OUTER}[case["turns"]]
    dx = INNER / case["resolution"]
    steps = int(np.ceil(END / SNAPSHOTS / min(0.1 * dx, 0.1 * (2.0 * dx) ** 2 / VISCOSITY)))
    scene = taylor_couette(
        case["resolution"],
        TURN * radius * (OUTER - INNER) / VISCOSITY,
        **turns,
        ghosts=case["ghosts"],
        h_over_dx=case["h_over_dx"],
        time_step=END / (SNAPSHOTS * steps),
        end_time=END,
        mach=TURN * radius / SOUND,
        scheme=SCHEMES[case["scheme"]],
    )
    return dataclasses.replace(scene, steps_per_snapshot=steps), CircularCouetteFlow(**turns)


if __name__ == "__main__":
    raise SystemExit(main())
