"""Water with a free surface that should come to rest, by both schemes.

    python -m benchmarks.free_surfaces --sets still dam

`still`: water of viscosity 1e-6 (g H)^(1/2) H in an open tank, from a lattice and from disordered
particles, for 20 s of (H / g)^(1/2) = 1 s. `dam`: dam breaks run on to rest at resolutions that no
scale has. Finished rows are in the JSON file at once; the same command goes on where it was cut
short.
"""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp
import numpy as np
from scipy.spatial import cKDTree

from jaxsph import Box, BoxRegion, Fluid, ParticleState, SimulationError, Space, Walls, run_scene
from jaxsph.arrangements import JitteredLattice, Lattice
from jaxsph.effects import Gravity, LaminarViscosity
from jaxsph.environment import environment
from jaxsph.kernels import WendlandC2
from jaxsph.scenes import Scene, dam_break
from jaxsph.schemes import Scheme

from .both_schemes import SCHEMES
from .measure import format_rows, number, progress
from .table import Table, command

SETS: dict[str, list[dict[str, Any]]] = {
    "still": [
        {"kind": "still", "dim": dim, "deep": deep, "h_over_dx": width, "jitter": jitter}
        for dim, deep, width, jitter in (
            (2, 8, 2.0, 0.0), (2, 16, 2.0, 0.0), (2, 32, 2.0, 0.0), (3, 8, 2.0, 0.0),
            (2, 16, 1.5, 0.0), (2, 16, 3.0, 0.0), (2, 16, 2.0, 0.2),
        )
    ],
    "dam": [{"kind": "dam", "along": along, "end": 8.0} for along in (30, 40, 50, 70, 110)],
}  # fmt: skip


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 2: bad input."""
    return command("free_surfaces", __doc__, _arguments, _run, argv)


def _arguments(add) -> None:
    add("--sets", choices=tuple(SETS), nargs="+", default=list(SETS), help="default: all")
    add("--schemes", choices=tuple(SCHEMES), nargs="+", default=list(SCHEMES), help="default: all")


def _run(options) -> None:
    kept = Table(options.json)
    cases = [case for name in options.sets for case in SETS[name]]
    keys = ({**case, "scheme": scheme} for case in cases for scheme in options.schemes)
    for key in kept.left(keys):
        kept.add({**key, **run(key), "environment": environment()})
    print(table(kept.rows))


def run(case: dict[str, Any]) -> dict[str, Any]:
    """Levels, speeds, densities and times of one run; what a lost one had until its fault."""
    scheme = SCHEMES[case["scheme"]]
    if case["kind"] == "still":
        settings = {k: case[k] for k in case if k not in ("kind", "scheme")}
        scene, level, unit = still_water(**settings, scheme=scheme), 1.0, 1.0
    else:
        scene = dam_break(case["along"], end_time=case["end"], scheme=scheme)
        (width, height), (length, _) = (scene.parameters[name] for name in ("column", "tank"))
        level, unit = width * height / length, (9.81 * height) ** 0.5
    fault = None
    with progress(case["kind"], scene.steps) as report:
        try:
            trajectory = run_scene(scene, progress=report)
        except SimulationError as error:
            trajectory, fault = error.trajectory, str(error)
    speed = np.linalg.norm(trajectory.velocity, axis=2).max(axis=1) / unit
    ratio = trajectory.density / float(scene.fluid.reference_density)
    found = 2.0 * trajectory.position[:, :, -1].mean(axis=1) / level - 1.0
    last = trajectory.position[-1]
    nearest = cKDTree(last).query(last, 2)[0][:, 1].min() / scene.space.spacing
    return {
        "fault": fault,
        "reached": float(trajectory.time[-1]),
        "end_time": scene.end_time,
        "level_change_percent": float(100.0 * found[-1]),
        "speed_at_fifths": [float(s) for s in speed[:: max(1, (len(speed) - 1) // 5)]],
        "last_speed": float(speed[-1]),
        "density_low": float(ratio.min()),
        "density_high": float(ratio.max()),
        "nearest_over_dx": float(nearest),
        "particles": trajectory.particles,
        "steps": scene.steps,
        "seconds": trajectory.timing.run_seconds,
        "compile_seconds": trajectory.timing.compile_seconds,
    }


def still_water(
    dim: int,
    deep: int,
    h_over_dx: float = 2.0,
    jitter: float = 0.0,
    scheme: Scheme = SCHEMES["consistent"],
    end: float = 20.0,
) -> Scene:
    """A cube of water 1 m deep in a tank 1.5 m high, g = 1 m/s^2, c0 = 10 m/s, at rest."""
    dx, size = 1.0 / deep, (1.0,) * (dim - 1) + (1.5,)
    box, tank = Box((0.0,) * dim, size, (False,) * dim), BoxRegion((0.0,) * dim, size)
    space = Space(box, WendlandC2(), h_over_dx * dx, dx)
    lattice = Lattice().positions(space)
    places = JitteredLattice(jitter).positions(space) if jitter else lattice
    position = places[np.asarray(lattice[:, -1]) < 1.0]
    effects = scheme.free_surface_effects(
        LaminarViscosity(1e-6),
        force=Gravity(jnp.zeros(dim).at[dim - 1].set(-1.0)),
        vessel=tank,
    )
    fluid, every = Fluid(1000.0, 10.0, 1.0), round(end / 20.0 / (0.1 * dx))
    density = fluid.density_of_enthalpy(1.0 - position[:, -1])
    return Scene(
        "still-water", effects, fluid, space, ParticleState(position, 0.0 * position, density),
        end / (20 * every), end, every, walls=Walls.around(tank, space),
    )  # fmt: skip


def table(rows: list[dict[str, Any]]) -> str:
    """Levels and speeds, a run a line."""
    lines = [
        [
            row["kind"],
            f"{row['dim']}D, {row['deep']}" if row["kind"] == "still" else str(row["along"]),
            number(row.get("h_over_dx")),
            number(row.get("jitter")),
            row["scheme"],
            number(row["level_change_percent"]),
            number(row["last_speed"]),
            number(row["density_low"]),
            number(row["density_high"]),
            number(row["seconds"]),
            "" if row["fault"] is None else f"lost at {row['reached']:.3g} s",
        ]
        for row in rows
    ]
    head = ["water", "particles", "h/dx", "jitter", "scheme", "level %", "last speed"]
    return format_rows([*head, "least density", "greatest", "s", "fault"], lines)


if __name__ == "__main__":
    raise SystemExit(main())
