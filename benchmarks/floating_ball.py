"""Heave of a floating ball, in three dimensions, against linear theory in water without end.

    python -m benchmarks.floating_ball --resolutions 8 10

A ball 0.3 m across of half the water's density (Kramer et al., Energies 14 (2021) 269, dropped ones
like it) is let go a tenth of its diameter above its place, in a closed tank. Linear theory is
`benchmarks.references.heaving_sphere`; no waves come back to it from walls. Every finished run's
row is in the JSON file at once; the same command goes on where it was cut short.
"""

from __future__ import annotations

import math
from typing import Any

import jax.numpy as jnp
import numpy as np

from jaxsph import BallRegion, Box, BoxRegion, FreeBody, WallPart, Walls, run_scene
from jaxsph.arrangements import Lattice
from jaxsph.cli import positive_float, positive_int
from jaxsph.effects import ArtificialViscosity, Gravity
from jaxsph.environment import environment
from jaxsph.scenes import Scene
from jaxsph.scenes.composed import composed
from jaxsph.scenes.scales import Scale
from jaxsph.schemes import Consistent
from jaxsph.walls.distances import distances

from .heaving import period
from .measure import format_rows, number, progress
from .references.heaving_sphere import Heave
from .table import Table, command

KEY = ("resolution", "width", "lift", "mach", "end_time")
DIAMETER, GRAVITY, DENSITY = 0.3, 9.81, 1000.0  # m, m/s^2, kg/m^3 of the water
DEPTH, TOP = 0.6, 0.9  # m of water, and of the tank
ALPHA = 0.02  # of the artificial viscosity
H_OVER_DX = 1.3
STEP, SNAPSHOT = 1.2, 0.01  # of h / c0, and s between snapshots
CROSSINGS = 3


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: a run was lost, 2: bad input."""
    return command("floating_ball", __doc__, _arguments, _run, argv)


def _arguments(add) -> None:
    add("--resolutions", type=positive_int, nargs="+", default=[8, 10], metavar="N",
        help="particles a diameter (default: 8 10)")  # fmt: skip
    add("--width", type=positive_float, default=1.2, metavar="W",
        help="of the tank, both ways [m] (default: 1.2)")  # fmt: skip
    add("--lift", type=positive_float, default=0.1, metavar="X",
        help="of the ball at the start, in diameters (default: 0.1)")  # fmt: skip
    add("--mach", type=positive_float, default=0.1, metavar="M", help="default: 0.1")
    add("--t-end", type=positive_float, default=1.1, metavar="T", help="default: 1.1 s")


def _run(options) -> None:
    kept = Table(options.json, KEY)
    others = (options.width, options.lift, options.mach, options.t_end)
    cases = (dict(zip(KEY, (n, *others), strict=True)) for n in options.resolutions)
    for case in kept.left(cases):
        kept.add(case | run(case))
    names = ("period", "linear_period", "trough", "linear_trough", "crest", "linear_crest",
             "sideways_in_spacings", "largest_turn", "seconds")  # fmt: skip
    rows = [(str(r["resolution"]), *(number(r[name], 3) for name in names)) for r in kept.rows]
    print(format_rows(("a diameter", *names), rows))


def run(case: dict[str, Any]) -> dict[str, Any]:
    """Period and first swings, what they should be, and what the run took."""
    scene = floating_ball(case)
    with progress(f"{case['resolution']} a diameter", scene.steps) as report:
        trajectory = run_scene(scene, progress=report, measure=None, averaged=None)
    position, time = np.asarray(trajectory.bodies.position[:, 0]), trajectory.time
    height, lift = position[:, 2] - DEPTH, case["lift"] * DIAMETER
    linear = Heave(0.5 * DIAMETER, GRAVITY).height(time, lift)
    deviation = np.abs(height - linear).max() / lift
    sideways = np.linalg.norm(np.ptp(position[:, :2], axis=0))
    return {
        "particles": trajectory.particles,
        "period": period(time, height, CROSSINGS),
        "linear_period": period(time, linear, CROSSINGS),
        **{name: value / lift for name, value in swings(height).items()},
        **{f"linear_{name}": value / lift for name, value in swings(linear).items()},
        "room": room(scene),
        "largest_deviation_percent": float(100.0 * deviation),
        "sideways_in_spacings": float(sideways / scene.space.spacing),
        "largest_turn": float(np.linalg.norm(trajectory.bodies.angle, axis=2).max()),
        "seconds": trajectory.metadata["run_seconds"],
        "steps": scene.steps,
        "environment": environment(),
    }


def floating_ball(case: dict[str, Any]) -> Scene:
    """The scene of a row."""
    width, spacing, radius = case["width"], DIAMETER / case["resolution"], 0.5 * DIAMETER
    middle = (0.5 * width, 0.5 * width, DEPTH + case["lift"] * DIAMETER)
    ball, tank = BallRegion(middle, radius), BoxRegion((0.0,) * 3, (width, width, TOP))
    speed = math.sqrt(GRAVITY * DEPTH)
    count = math.ceil(SNAPSHOT * speed / case["mach"] / (STEP * H_OVER_DX * spacing))
    effects = Consistent().free_surface_effects(
        ArtificialViscosity(jnp.asarray(ALPHA)),
        force=Gravity(jnp.asarray([0.0, 0.0, -GRAVITY])),
        vessel=tank,
    )
    return composed(
        "floating-ball",
        effects=effects,
        box=Box((0.0,) * 3, (width, width, TOP), (False,) * 3),
        scale=Scale(round(width / spacing), H_OVER_DX, SNAPSHOT / count, count),
        end_time=case["end_time"],
        reference_density=DENSITY,
        reference_speed=speed,
        mach=case["mach"],
        region=BoxRegion((0.0,) * 3, (width, width, DEPTH)) & ~ball,
        walls=lambda space: Walls.around(
            tank,
            space,
            parts=(WallPart("ball", ball),),
            free_bodies=(FreeBody.of_density(ball, 0.5 * DENSITY, space),),
        ),
        pressure=lambda x: DENSITY * GRAVITY * (DEPTH - x[:, 2]),
        arrangement=Lattice(),
        parameters=case,
    )


def room(scene: Scene) -> float:
    """What the cells of the lattice that are the ball's take up, over its own volume."""
    body = scene.walls.free.parts[0]
    cells = distances(body.region, scene.space.lattice()) < 0.0
    return float(cells.sum() * scene.space.cell_volume * 0.5 * DENSITY / body.mass)


def swings(height: np.ndarray) -> dict[str, float]:
    """The lowest height, and the highest after it [m]."""
    lowest = int(np.argmin(height))
    return {"trough": float(height[lowest]), "crest": float(height[lowest:].max())}


if __name__ == "__main__":
    raise SystemExit(main())
