"""The schemes beside each other: errors with their times, and what each does with its energy.

    python -m benchmarks.schemes --sets vortex plane rest cavity

`vortex`: Taylor-Green against its exact solution at 1 s. `mach`: how much of that is the sound
speed's. `space`: in three dimensions, kinetic energy against a spectral solution. `plane`: Couette
and Poiseuille flow. `rest`: disordered particles at rest, kicked, or under gravity, for 20 s.
`vessels`: a disc in rotation, and flow between a turning cylinder and a fixed one. `cavity`: the
lid-driven cavity against a converged solver by second-order probes. `rates`: one right-hand side
and its gradient by reverse mode, both schemes in turns. Finished rows are in the JSON file at once;
the same command goes on where it was cut short.
"""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxsph import SimulationError, run_scene
from jaxsph.environment import environment
from jaxsph.scenes import SCENES, Scene

from .both_schemes import SCHEMES
from .measure import alternate, compiled, format_rows, number, progress
from .scheme_scenes import KINDS
from .table import Table, command

_REPEATS = 30


def _case(kind, **settings):
    return {"kind": kind, **settings}


SETS: dict[str, list[dict[str, Any]]] = {
    "vortex": [
        _case("vortex", side=side, reynolds=reynolds, mach=0.1)
        for reynolds, sides in ((100.0, (25, 50, 100)), (1000.0, (25, 50, 100)))
        for side in sides
    ],
    "mach": [
        _case("vortex", side=side, reynolds=100.0, mach=mach)
        for side in (25, 50, 100)
        for mach in (0.05, 0.025)
    ],
    "plane": [
        _case(kind, side=side, reynolds=10.0)
        for kind in ("couette", "poiseuille")
        for side in (25, 50)
    ],
    "rest": [
        _case("box", side=side, dim=dim, walls=walls, start=start, reynolds=reynolds)
        for dim, side in ((2, 20), (3, 8), (3, 10))
        for walls, start in (
            ("closed", "rest"), ("closed", "kick"), ("closed", "gravity"), ("periodic", "rest"),
            ("periodic", "kick"),
        )
        for reynolds in (1e6,)
        # three supports fit into ten spacings, not into eight
        if dim == 2 or (walls == "closed") == (side == 8)
    ],
    "space": [_case("space", side=side, reynolds=100.0) for side in (24, 32)],
    "vessels": [
        _case("disc", side=24, reynolds=1000.0),
        *(_case("taylor-couette", side=side, reynolds=20.0) for side in (20, 40)),
    ],
    "cavity": [
        _case("cavity", side=side, reynolds=reynolds, lid=lid, end=end)
        for lid, reynolds, side, end in (
            ("regularised", 100.0, 40, 12.0), ("constant", 100.0, 32, 10.0),
            ("constant", 400.0, 32, 20.0), ("constant", 400.0, 32, 40.0),
            ("constant", 1000.0, 32, 40.0), ("constant", 400.0, 50, 40.0),
        )
    ],
    "rates": [
        _case("rates", scene=scene, side=side)
        for scene, side in (
            ("taylor-green", 50), ("taylor-green", 100), ("lid-driven-cavity", 50),
            ("lid-driven-cavity", 100), ("taylor-green-3d", 24),
        )
    ],
}  # fmt: skip


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 2: bad input."""
    return command("schemes", __doc__, _arguments, _run, argv)


def _arguments(add) -> None:
    add("--sets", choices=tuple(SETS), nargs="+", default=list(SETS), help="default: all")
    add("--schemes", choices=tuple(SCHEMES), nargs="+", default=list(SCHEMES), help="default: all")


def _run(options) -> None:
    kept = Table(options.json)
    for key in kept.left(_cases(options)):
        found = rates(key) if key["scheme"] == "both" else run(key, key["scheme"])
        kept.add({**key, **found, "environment": environment()})
    print(table(kept.rows))


def _cases(options):
    for case in (case for name in options.sets for case in SETS[name]):
        for scheme in ("both",) if case["kind"] == "rates" else options.schemes:
            yield {**case, "scheme": scheme}


def run(case: dict[str, Any], scheme: str) -> dict[str, Any]:
    """Errors, energy, density and times of one run; what a lost one had until its fault."""
    make, judge = KINDS[case["kind"]]
    scene = make(case, SCHEMES[scheme])
    fault = {}
    with progress(case["kind"], scene.steps) as report:
        try:
            trajectory = run_scene(scene, progress=report)
        except SimulationError as error:
            trajectory, fault = error.trajectory, {"fault": str(error)}
    density = trajectory.density / float(scene.fluid.reference_density)
    return {
        **fault,
        **({} if fault else judge(case, scene, trajectory)),
        "reached": float(trajectory.time[-1]),
        "largest_speed": float(np.linalg.norm(trajectory.velocity, axis=2).max()),
        "last_speed": float(np.linalg.norm(trajectory.velocity[-1], axis=1).max()),
        "density_low": float(density.min()),
        "density_high": float(density.max()),
        "mean_density_change": float(density[-1].mean() - density[0].mean()),
        "largest_energy_over_start": _energy(scene, trajectory),
        "particles": trajectory.particles,
        "steps": scene.steps,
        "seconds": trajectory.timing.run_seconds,
        "compile_seconds": trajectory.timing.compile_seconds,
    }


def rates(case: dict[str, Any]) -> dict[str, Any]:
    """Least times of a right-hand side and of a gradient through it [ms], and their ratios."""
    calls = {}
    for name, scheme in SCHEMES.items():
        scene = SCENES[case["scene"]](case["side"], scheme=scheme)
        neighbors = scene.search().build(scene.state.position)
        arguments = scene.state, scene.functional(), neighbors
        calls[f"{name}_ms"] = compiled(_change, *arguments)[0]
        calls[f"{name}_gradient_ms"] = compiled(jax.grad(_squared), *arguments)[0]
    wall, _ = alternate(calls, _REPEATS)
    found = {name: 1e3 * min(seconds) for name, seconds in wall.items()}
    return {
        **found,
        "ratio": found["consistent_ms"] / found["delta-plus_ms"],
        **{
            f"{name}_reverse_over_forward": found[f"{name}_gradient_ms"] / found[f"{name}_ms"]
            for name in SCHEMES
        },
    }


def _change(state, functional, neighbors):
    return functional(jnp.zeros((), state.density.dtype), state, neighbors)


def _squared(*arguments):
    return sum(jnp.sum(leaf**2) for leaf in jax.tree.leaves(_change(*arguments)))


def _energy(scene: Scene, trajectory) -> float | None:
    """Largest sum m (|u|^2 + c0^2 (rho / rho0 - 1)^2) / 2 over the first; None from rest."""
    density = trajectory.density / float(scene.fluid.reference_density) - 1.0
    acoustic = float(scene.fluid.sound_speed) ** 2 * (density**2).sum(axis=1)
    energy = (trajectory.velocity**2).sum(axis=(1, 2)) + acoustic
    return float(energy.max() / energy[0]) if energy[0] > 0.0 else None


def table(rows: list[dict[str, Any]]) -> str:
    """One line a run."""
    header = ("case", "scheme", "error %", "p or v %", "energy", "speed", "mean rho", "run s")
    cells = []
    for row in rows:
        if row["kind"] == "rates":
            continue
        told = ("side", "dim", "reynolds", "walls", "start", "lid", "end", "mach")
        settings = [str(row[k]) for k in told if k in row]
        first = row.get("velocity_error_percent", row.get("u_error_percent"))
        first = row.get("energy_error_percent") if row["kind"] == "space" else first
        second = row.get("pressure_error_percent", row.get("v_error_percent"))
        lost = f"lost at {row['reached']:.3g} s" if "fault" in row else number(row["last_speed"])
        cells.append((
            " ".join([row["kind"], *settings]), row["scheme"], number(first), number(second),
            number(row["largest_energy_over_start"], 4), lost,
            number(row["mean_density_change"]), number(row["seconds"]),
        ))  # fmt: skip
    return format_rows(header, cells)


if __name__ == "__main__":
    raise SystemExit(main())
