"""Derivatives of a cylinder's mean drag through the full model, beside central differences.

    python -m benchmarks.drag_slopes --seconds 0.2 1

A uniform stream past a cylinder at Re = 40, box of 4 x 4 diameters and its fringe: the mean of drag
over the run, of every stage of every step (`ForcesOverTime`), differentiated in the viscosity and
in the speed of the stream, which flows in and is everywhere at the start; that of sound stays.
Reverse mode, forward mode, and central differences at several steps, relative to the parameter; all
are in the file. Steps are equal, so that none is chosen anew beside a parameter; what it makes that
the neighbour list is built anew at every step is told, too. Every finished run's row is in the JSON
file at once; the same command goes on where it was cut short.
"""

from __future__ import annotations

import dataclasses
import time as clock
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp

from jaxsph import COMPILER_OPTIONS, ForcesOverTime, WallForces
from jaxsph.cli import positive_float, positive_int
from jaxsph.effects import Fringe, UniformProfile
from jaxsph.environment import environment
from jaxsph.integrate import FaultCode, integrate
from jaxsph.scenes import Scene, cylinder

from .measure import format_rows, number
from .table import Table, command

KEY = ("resolution", "reynolds", "seconds_of_flow")
PARAMETERS = ("viscosity", "speed")
DIFFERENCES = (1e-3, 1e-4, 1e-5, 1e-6)  # of the parameter
REYNOLDS = 40.0
DOMAIN = {"upstream": 1.5, "downstream": 2.5, "width": 4.0, "h_over_dx": 1.3}


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 2: bad input."""
    return command("drag_slopes", __doc__, _arguments, _run, argv)


def _arguments(add) -> None:
    add("--resolution", type=positive_int, default=8, metavar="N",
        help="particles a diameter (default: 8)")  # fmt: skip
    add("--seconds", type=positive_float, nargs="+", default=[0.2, 1.0], metavar="T",
        help="of flow (default: 0.2 1)")  # fmt: skip


def _run(options) -> None:
    kept = Table(options.json, KEY, beside=lambda rows: {"environment": environment()})
    cases = (
        dict(zip(KEY, (options.resolution, REYNOLDS, seconds), strict=True))
        for seconds in options.seconds
    )
    for case in kept.left(cases):
        kept.add(case | run(case))
    print(_table(kept.rows))


def mean_drag(scene: Scene, seconds: float) -> tuple[Callable, int]:
    """Viscosity [m^2/s] and speed of the stream [m/s] -> mean drag on the cylinder [N] and the
    fault's code; and the number of steps in it. The list is built anew in each of `intervals`."""
    steps = max(1, round(seconds / scene.time_step))
    model, step = ForcesOverTime(scene.model(), WallForces.of(scene)), jnp.asarray(scene.time_step)
    (friction,) = (effect for effect in scene.effects if hasattr(effect, "viscosity"))
    (fringe,) = (effect for effect in scene.effects if isinstance(effect, Fringe))

    def mean(viscosity, speed, intervals=1):
        inflow = UniformProfile(speed)
        ours = model.model.with_effect(dataclasses.replace(friction, viscosity=viscosity))
        ours = ours.with_effect(dataclasses.replace(fringe, profile=inflow))
        start = dataclasses.replace(scene.state, velocity=speed * scene.state.velocity)
        ours, first = dataclasses.replace(model, model=ours), jnp.zeros((), jnp.int32)
        end, fault, _, _ = integrate(
            ours, ours.start(start), first, step, steps // intervals, intervals
        )
        forces, _ = end.means(model.forces.names, steps * step)
        return forces["cylinder"][0], fault.code

    return mean, steps


def run(case: dict[str, Any]) -> dict[str, Any]:
    """Derivatives in both parameters, relative to them, and by differences."""
    scene = cylinder(case["resolution"], case["reynolds"], end_time=0.3, **DOMAIN)
    mean, steps = mean_drag(scene, case["seconds_of_flow"])
    base = jnp.asarray([1.0 / case["reynolds"], 1.0])  # U = D = 1

    def compiled(function):
        return jax.jit(function, compiler_options=COMPILER_OPTIONS)

    value = compiled(lambda p: mean(*p))
    before = clock.perf_counter()
    slopes, code = compiled(jax.grad(lambda p: mean(*p), has_aux=True))(base)
    seconds = clock.perf_counter() - before
    if int(code) != int(FaultCode.NONE):
        raise ValueError(f"seconds: the run met fault {int(code)}; take fewer.")
    forward = compiled(lambda way: jax.jvp(lambda p: mean(*p)[0], (base,), (way,))[1])
    drag, anew = float(value(base)[0]), compiled(lambda p: mean(*p, intervals=steps)[0])
    rows = []
    for index, name in enumerate(PARAMETERS):
        unit = jnp.zeros(2).at[index].set(base[index])
        slope, off = float(slopes @ unit), {}
        for share in DIFFERENCES:
            more, less = (float(value(base + k * share * unit)[0]) for k in (1, -1))
            off[f"{share:g}"] = abs((more - less) / (2.0 * share) / slope - 1.0)
        rows.append(
            {
                "parameter": name,
                "drag_per_share": slope,
                "forward_deviation": abs(float(forward(unit)) / slope - 1.0),
                "deviation_by_difference": off,
                "deviation": min(off.values()),
            }
        )
    return {
        "particles": len(scene.state.position),
        "steps": steps,
        "drag": drag,
        "list_built_anew_changes_it_by": abs(float(anew(base)) / drag - 1.0),
        "slopes": rows,
        "gradient_seconds_with_compilation": seconds,
    }


def _table(rows) -> str:
    head = ("s of flow", "drag [N]", "in", "slope", "off forward", *map(str, DIFFERENCES))
    found = [
        (number(row["seconds_of_flow"]), number(row["drag"], 5), slope["parameter"],
         number(slope["drag_per_share"], 5), number(slope["forward_deviation"], 2),
         *(number(off, 2) for off in slope["deviation_by_difference"].values()))
        for row in rows for slope in row["slopes"]
    ]  # fmt: skip
    return format_rows(head, found)


if __name__ == "__main__":
    raise SystemExit(main())
