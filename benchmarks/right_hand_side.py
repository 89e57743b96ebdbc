"""Time of one delta-plus-SPH right-hand side, of its derivatives and of its neighbour list.

    python -m benchmarks.right_hand_side --particles 10000 --h-over-dx 4 --json FILE

The Taylor-Green scene on a jittered lattice, its own neighbour search and list. Times are medians
over repeats in which the calls take turns; ns_per_pair counts the pairs that interact, not the
slots of the list. `in order` is the right-hand side without `jaxsph.COMPILER_OPTIONS`.
"""

from __future__ import annotations

import math
import time as clock
from dataclasses import replace
from functools import partial
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from jaxsph import FullModel, ParticleState, SimulationError, simulate
from jaxsph.cli import ARRANGEMENTS, SCALES, positive_float, positive_int
from jaxsph.environment import environment
from jaxsph.integrate import FaultCode, rk4_step
from jaxsph.scenes import Scene, taylor_green
from jaxsph.schemes import DeltaPlus

from .measure import (
    alternate,
    compiled,
    format_rows,
    interacting_pairs,
    number,
    peak_memory_gib,
    summary,
    tell,
    write_json,
)
from .table import command


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 2: bad input."""
    return command("right_hand_side", __doc__, _arguments, _run, argv, json=None)


def _run(options) -> None:
    with jax.enable_x64(options.precision == "float64"):
        results = measure(options)
    if options.json is not None:
        write_json(options.json, results)
    print(_table(results))


def _arguments(add) -> None:
    add("--particles", type=positive_int, default=10_000, metavar="N",
        help="the nearest square is taken (default: %(default)s)")  # fmt: skip
    add("--h-over-dx", type=positive_float, default=4.0, metavar="X", help="default: %(default)g")
    add("--precision", choices=("float32", "float64"), default="float64",
        help="default: %(default)s")  # fmt: skip
    add("--scale", choices=SCALES, default="paper",
        help="whose dt/dx and snapshot interval are taken (default: %(default)s)")  # fmt: skip
    add("--arrangement", choices=tuple(ARRANGEMENTS), default="jittered",
        help="how particles start (default: %(default)s)")  # fmt: skip
    add("--repeats", type=positive_int, default=15, metavar="K", help="default: %(default)s")
    add("--rebuild-steps", type=positive_int, default=20, metavar="K",
        help="steps, rounded up to whole snapshot intervals, in which rebuilds of the list are "
        "counted (default: %(default)s)")  # fmt: skip
    add("--run-steps", type=int, default=0, metavar="K",
        help="first run so many steps (rounded up as well), so that the peak of memory is that of "
        "a run (default: 0)")  # fmt: skip


def measure(options) -> dict[str, Any]:
    """All figures, by the names under which they are written."""
    scene = taylor_green(
        max(1, round(math.sqrt(options.particles))),
        scale=options.scale,
        h_over_dx=options.h_over_dx,
        arrangement=ARRANGEMENTS[options.arrangement](seed=0),
        scheme=DeltaPlus(),
        dtype=options.precision,
    )
    model = scene.model()
    results: dict[str, Any] = {"run": _short_run(scene, options.run_steps)}
    peak = peak_memory_gib()  # before the derivatives add to it
    build, build_compile = compiled(model.search.build, scene.state.position)
    neighbors = build()
    if bool(neighbors.overflow):
        raise ValueError("neighbours: the list overflows; choose another arrangement.")
    calls, compile_seconds = {"rebuild": build}, {"rebuild": build_compile}
    for name, (function, arguments) in _right_hand_sides(scene, neighbors).items():
        calls[name], compile_seconds[name] = compiled(function, *arguments)
        tell(f"{name}: compiled in {compile_seconds[name]:.1f} s")
    value, arguments = _right_hand_sides(scene, neighbors)["primal"]
    calls["in order"], compile_seconds["in order"] = compiled(value, *arguments, options=None)
    wall, busy = alternate(calls, options.repeats)
    times = {name: summary(seconds) for name, seconds in wall.items()}
    particles = scene.state.position.shape[0]
    pairs = interacting_pairs(scene.state.position, scene.space)
    primal, rebuild = times["primal"], times["rebuild"]
    rebuilds, steps = _rebuilds(scene, model, options.rebuild_steps)
    spent = rebuilds * rebuild["median"]
    return results | {
        "seconds": primal["median"],
        "seconds_min": primal["min"],
        "seconds_spread": primal["spread"],
        "pairs": pairs,
        "ns_per_pair": 1e9 * primal["median"] / pairs,
        "ns_per_pair_min": 1e9 * primal["min"] / pairs,
        "cores_busy": sum(busy["primal"]) / sum(wall["primal"]),
        "in_order_ratio": times["in order"]["median"] / primal["median"],
        "jvp_ratio": times["jvp"]["median"] / primal["median"],
        "vjp_ratio": times["vjp"]["median"] / primal["median"],
        "rebuild_seconds": rebuild["median"],
        "rebuild_share": spent / (spent + 4 * steps * primal["median"]),
        "rebuilds": rebuilds,
        "rebuild_steps": steps,
        "compile_seconds": compile_seconds,
        "times": times,
        "repeats": options.repeats,
        "device": jax.devices()[0].device_kind,
        "dtype": str(scene.state.position.dtype),
        "particles": particles,
        "h_over_dx": options.h_over_dx,
        "neighbors": pairs / particles,
        "list_capacity": model.search.capacity,
        "peak_memory_gib": peak if options.run_steps > 0 else peak_memory_gib(),
        "peak_memory_of": "run" if options.run_steps > 0 else "benchmark",
        "parameters": scene.parameters,
        "environment": environment(),
    }


def _right_hand_sides(scene: Scene, neighbors) -> dict[str, tuple[Any, tuple]]:
    """Value; value and derivative along (rho, u); value and pullback to (x, u, rho)."""
    state, functional = scene.state, scene.functional()
    time = jnp.zeros((), state.density.dtype)
    random = np.random.default_rng(0)

    def like(array):
        return jnp.asarray(random.standard_normal(array.shape), array.dtype)

    def value(functional, state, neighbors):
        return functional(time, state, neighbors)

    def along(functional, state, neighbors, tangent):
        def at_fixed_positions(density, velocity):
            return functional(time, ParticleState(state.position, velocity, density), neighbors)

        return jax.jvp(at_fixed_positions, (state.density, state.velocity), tangent)

    def back(functional, state, neighbors, cotangent):
        rates, pull = jax.vjp(lambda state: functional(time, state, neighbors), state)
        return rates, pull(cotangent)

    fixed = (functional, state, neighbors)
    tangent = (like(state.density), like(state.velocity))
    return {
        "primal": (value, fixed),
        "jvp": (along, (*fixed, tangent)),
        "vjp": (back, (*fixed, jax.tree.map(like, state))),
    }


def _whole_intervals(scene: Scene, steps: int) -> int:
    return scene.steps_per_snapshot * -(-steps // scene.steps_per_snapshot)


def _short_run(scene: Scene, steps: int) -> dict[str, Any] | None:
    """A short run by the library's own loop."""
    if steps <= 0:
        return None
    steps = _whole_intervals(scene, steps)
    tell(f"running {steps} steps")
    schedule = replace(scene.schedule, intervals=steps // scene.steps_per_snapshot)
    trajectory = simulate(scene.model(), scene.state, schedule)
    seconds = trajectory.timing.run_seconds
    compile_seconds = trajectory.timing.compile_seconds
    return {
        "steps": steps,
        "seconds_per_step": seconds / steps,
        "compile_seconds": compile_seconds,
    }


def _rebuilds(scene: Scene, model: FullModel, steps: int) -> tuple[int, int]:
    """How often the list is built in a run of the full model, as `integrate` runs it; and steps."""
    steps = _whole_intervals(scene, steps)
    dt = jnp.asarray(scene.time_step, scene.state.density.dtype)

    def step(model, carry, number):
        state, neighbors, count = carry
        new = model.refresh(neighbors, state, dt)
        count = count + jnp.any(new.reference != neighbors.reference).astype(jnp.int32)
        time = number.astype(dt.dtype) * dt
        state = rk4_step(lambda t, y: model.rates(t, y, new), time, state, dt)
        return (model.finish(state), new, count), None

    def interval(model, carry, start):
        state, count, _ = carry
        numbers = start + jnp.arange(scene.steps_per_snapshot, dtype=jnp.int32)
        carry = (state, model.prepare(state), count + 1)
        (state, neighbors, count), _ = lax.scan(partial(step, model), carry, numbers)
        fault = model.inspect(numbers[-1] + 1, state, neighbors)
        return (state, count, fault), fault

    @eqx.filter_jit
    def run(model, state):
        starts = jnp.arange(0, steps, scene.steps_per_snapshot, dtype=jnp.int32)
        none = model.inspect(jnp.zeros((), jnp.int32), state, model.prepare(state))
        carry = (state, jnp.zeros((), jnp.int32), none)
        (_, count, _), faults = lax.scan(partial(interval, model), carry, starts)
        return count, faults

    start = clock.perf_counter()
    count, faults = jax.block_until_ready(run(model, scene.state))
    failed = np.flatnonzero(np.asarray(faults.code) != int(FaultCode.NONE))
    if len(failed):
        fault = jax.tree.map(lambda a: a[failed[0]], faults)
        raise ValueError(f"counting rebuilds: {SimulationError(fault, scene.time_step)}")
    tell(f"{int(count)} lists built in {steps} steps ({clock.perf_counter() - start:.1f} s)")
    return int(count), steps


def _table(results: dict[str, Any]) -> str:
    title = (
        f"{results['particles']} particles, h = {results['h_over_dx']:g} dx, "
        f"{results['neighbors']:.0f} neighbours, {results['dtype']}, {results['device']}"
    )
    rows = []
    for name in ("primal", "in order", "jvp", "vjp", "rebuild"):
        times = results["times"][name]
        rows.append((
            name,
            *(number(1e3 * times[key], 4) for key in ("median", "min", "spread")),
            number(1e9 * times["median"] / results["pairs"]),
            number(times["median"] / results["seconds"]),
            number(results["compile_seconds"][name]),
        ))  # fmt: skip
    header = ("", "median ms", "min ms", "spread ms", "ns/pair", "ratio", "compile s")
    below = (
        f"cores busy {results['cores_busy']:.2f}; rebuilding {100 * results['rebuild_share']:.1f} "
        f"% of a run ({results['rebuilds']} lists in {results['rebuild_steps']} steps); "
        f"peak memory {results['peak_memory_gib']:.2f} GiB"
    )
    return f"{title}\n{format_rows(header, rows)}\n{below}"


if __name__ == "__main__":
    raise SystemExit(main())
