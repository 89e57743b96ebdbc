"""What walls cost: one right-hand side of a cavity beside that of a periodic box, per particle.

    python -m benchmarks.wall_cost --sides 50 100

The cavity and the Taylor-Green scene, both on a jittered lattice with h = 2 dx and with neighbour
lists of the same capacity. Times are medians over repeats in which both take turns; float64.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp

from jaxsph.arrangements import JitteredLattice
from jaxsph.cli import positive_int
from jaxsph.environment import environment
from jaxsph.scenes import lid_driven_cavity, taylor_green
from jaxsph.schemes import DeltaPlus

from .measure import alternate, compiled, format_rows, number, summary, tell, write_json
from .table import command

_MARGIN = 1.3  # of both scenes' neighbour lists


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 2: bad input."""
    return command("wall_cost", __doc__, _arguments, _run, argv)


def _arguments(add) -> None:
    add("--sides", type=positive_int, nargs="+", default=[50, 100], metavar="N",
        help="particles per side (default: 50 100)")  # fmt: skip
    add("--repeats", type=positive_int, default=31, metavar="K", help="default: %(default)s")


def _run(options) -> None:
    rows = [measure(side, options.repeats) for side in options.sides]
    write_json(
        options.json,
        {"rows": rows, "device": jax.devices()[0].device_kind, "environment": environment()},
    )
    print(_table(rows))


def measure(side: int, repeats: int) -> dict[str, Any]:
    """Times of both right-hand sides and of their lists, and their ratios."""
    given = {"arrangement": JitteredLattice(amplitude=0.2), "scheme": DeltaPlus()}
    scenes = {
        "walled": lid_driven_cavity(side, **given),
        "periodic": taylor_green(side, h_over_dx=2.0, **given),
    }
    searches = {name: scene.search(margin=_MARGIN) for name, scene in scenes.items()}
    room = max(searches["walled"].fluid.capacity, searches["periodic"].capacity)
    searches["periodic"] = replace(searches["periodic"], capacity=room)
    searches["walled"] = replace(
        searches["walled"], fluid=replace(searches["walled"].fluid, capacity=room)
    )
    calls, compile_seconds = {}, {}
    for name, scene in scenes.items():
        search, position = searches[name], scene.state.position
        build, compile_seconds[f"{name}_list"] = compiled(lambda s, x: s.build(x), search, position)
        neighbors = build()
        if bool(neighbors.overflow):
            raise ValueError("neighbours: the list overflows; raise the margin.")
        calls[f"{name}_list"] = build
        calls[name], compile_seconds[name] = compiled(
            _rates, scene.functional(), scene.state, neighbors
        )
        tell(f"{name}, {side} x {side}: compiled in {compile_seconds[name]:.1f} s")
    wall, _ = alternate(calls, repeats)
    times = {name: summary(seconds) for name, seconds in wall.items()}
    particles = side * side
    ghosts = scenes["walled"].walls.position.shape[0]
    ratio = {
        key: times["walled"][key] / times["periodic"][key] for key in ("median", "min")
    }  # the minimum is the less disturbed one on a busy machine
    return {
        "side": side,
        "particles": particles,
        "ghosts": ghosts,
        "near_walls": searches["walled"].near_capacity,
        "list_capacity": room,
        "wall_list_capacity": searches["walled"].capacity,
        "times": times,
        "compile_seconds": compile_seconds,
        "ratio_per_fluid_particle": ratio["median"],
        "ratio_per_fluid_particle_min": ratio["min"],
        "ratio_per_particle_and_ghost": ratio["median"] * particles / (particles + ghosts),
        "list_ratio": times["walled_list"]["median"] / times["periodic_list"]["median"],
        "effects": {name: [e.name for e in scene.effects] for name, scene in scenes.items()},
    }


def _rates(functional, state, neighbors):
    return functional(jnp.zeros((), state.density.dtype), state, neighbors)


def _table(rows: list[dict[str, Any]]) -> str:
    header = ("side", "ghosts", "periodic ms", "walled ms", "ratio", "ratio (min)", "with ghosts",
              "list ratio")  # fmt: skip
    cells = [
        (
            str(row["side"]),
            str(row["ghosts"]),
            *(number(1e3 * row["times"][name]["median"]) for name in ("periodic", "walled")),
            number(row["ratio_per_fluid_particle"]),
            number(row["ratio_per_fluid_particle_min"]),
            number(row["ratio_per_particle_and_ghost"]),
            number(row["list_ratio"]),
        )
        for row in rows
    ]
    return format_rows(header, cells)


if __name__ == "__main__":
    raise SystemExit(main())
