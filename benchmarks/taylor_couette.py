"""Torque between two cylinders, of which one turns, against the exact one.

    python -m benchmarks.taylor_couette --resolutions 8 16 32

From the exact flow on, mean torques over the second half of 1 s, by N particles to the inner
cylinder's radius, and how far the mean velocity around is from the exact one. Every finished run's
row is in the JSON file at once; the same command goes on where it was cut short.
"""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp
import numpy as np

from jaxsph import (
    BallRegion,
    Box,
    Fluid,
    MovingWall,
    ParticleState,
    Space,
    WallPart,
    Walls,
    run_scene,
)
from jaxsph.arrangements import Lattice
from jaxsph.cli import positive_float, positive_int
from jaxsph.environment import environment
from jaxsph.kernels import WendlandC2
from jaxsph.scenes import Scene
from jaxsph.schemes import SCHEMES

from .measure import format_rows, number, progress
from .table import Table, command

KEY = ("scheme", "turns", "resolution", "h_over_dx")
INNER, OUTER, TURN, VISCOSITY, DENSITY = 0.3, 0.6, 1.0, 0.05, 1000.0  # m, m, 1/s, m^2/s, kg/m^3
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
    add("--h-over-dx", type=positive_float, default=2.0, metavar="X", help="default: 2")


def _run(options) -> None:
    kept = Table(options.json, KEY)
    cases = (
        {"scheme": scheme, "turns": turns, "resolution": n, "h_over_dx": options.h_over_dx}
        for n in options.resolutions
        for scheme in options.schemes
        for turns in options.turns
    )
    for case in kept.left(cases):
        kept.add(case | run(case))
    names = ("scheme", "turns", "resolution")
    found = ("inner_torque_error_percent", "outer_torque_error_percent", "velocity_error_percent")
    rows = [(*(str(r[n]) for n in names), *(number(r[n], 3) for n in found)) for r in kept.rows]
    print(format_rows((*names, "inner %", "outer %", "velocity %"), rows))


def run(case: dict[str, Any]) -> dict[str, Any]:
    """Errors of mean torques and of the mean velocity around, and what they took."""
    scene, a, b = annulus(case)
    with progress(f"{case['resolution']} to the radius", scene.steps) as report:
        trajectory = run_scene(scene, progress=report)
    late = trajectory.time > 0.5 * END + 1e-9
    exact = 4.0 * np.pi * VISCOSITY * DENSITY * b
    errors = {
        f"{name}_torque_error_percent": float(
            100.0 * (sign * trajectory.mean_torques[name][late].mean() / exact - 1.0)
        )
        for name, sign in (("inner", -1.0), ("outer", 1.0))
    }
    return errors | {
        "exact_torque": exact,
        "velocity_error_percent": profile_error(trajectory, late, a, b),
        "seconds": trajectory.metadata["run_seconds"],
        "steps": scene.steps,
        "particles": trajectory.particles,
        "environment": environment(),
    }


def profile_error(trajectory, late, a, b) -> float:
    """Mean velocity around in rings, off the exact one in root mean square, in percent of that."""
    position, velocity = trajectory.position[late], trajectory.velocity[late]
    radius = np.linalg.norm(position, axis=2)
    speed = position[..., 0] * velocity[..., 1] - position[..., 1] * velocity[..., 0]
    exact = a * radius + b / radius
    edges = np.linspace(INNER, OUTER, RINGS + 1)
    found, expected = (
        np.histogram(radius, edges, weights=each)[0] for each in (speed / radius, exact)
    )
    return float(100.0 * np.linalg.norm(found - expected) / np.linalg.norm(expected))


def annulus(case: dict[str, Any]) -> tuple[Scene, float, float]:
    """The scene, which starts with its exact flow u = a r + b / r, and a [1/s] and b [m^2/s]."""
    dx = INNER / case["resolution"]
    inner, outer = (BallRegion((0.0, 0.0), radius) for radius in (INNER, OUTER))
    parts = [WallPart("inner", inner), WallPart("outer", ~outer)]
    (turning,) = (part for part in parts if part.name == case["turns"])
    box = Box((-0.8, -0.8), (0.8, 0.8), (False, False))
    space, region = Space(box, WendlandC2(), case["h_over_dx"] * dx, dx), outer & ~inner
    lid = MovingWall(turning.region, lambda x: around(x, TURN, 0.0))
    walls = Walls.around(region, space, [lid], parts=parts)
    position = Lattice().positions(space)
    position = position[np.asarray(region.signed_distance(position)) < 0.0]
    position = walls.put_inside(position, 0.25 * dx)
    speeds = TURN * np.array([turning is part for part in parts])
    a, b = np.linalg.solve([[1.0, INNER**-2], [1.0, OUTER**-2]], speeds)
    density = jnp.full(len(position), DENSITY)
    state = ParticleState(position, around(position, a, b), density)
    effects = SCHEMES[case["scheme"]].effects(VISCOSITY, None, region)
    steps = int(np.ceil(END / SNAPSHOTS / min(0.1 * dx, 0.1 * (2.0 * dx) ** 2 / VISCOSITY)))
    scene = Scene(
        "taylor-couette", effects, Fluid(DENSITY, 10.0, 1.0), space, state,
        END / (SNAPSHOTS * steps), END, steps, walls=walls,
    )  # fmt: skip
    return scene, float(a), float(b)


def around(position, a, b):
    """a r + b / r around the origin [m/s] at positions (N, 2) [m]."""
    turn = a + b / jnp.sum(position**2, axis=1, keepdims=True)
    return jnp.stack([-position[:, 1], position[:, 0]], axis=1) * turn


if __name__ == "__main__":
    raise SystemExit(main())
