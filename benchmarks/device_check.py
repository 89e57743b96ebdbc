"""The one script to run where a GPU is: first whether its results are the CPU's, then its times.

    python -m benchmarks.device_check

Four minutes at most on a GPU: it stops between cases when its time is up, the most wanted first,
and what was measured is in the file by then. Beside a right-hand side and a gradient stands the
floor: the bytes that pair sums must read and write once, at the bandwidth of a copy measured here.
Exit code 1 where a result is not the CPU's.
"""

from __future__ import annotations

import sys
import time as clock
from collections.abc import Callable, Iterator
from functools import cache, partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.extend.core import jaxprs_in_params

from jaxsph import platform_options, run_scene
from jaxsph.arrangements import JitteredLattice, Lattice
from jaxsph.cli import positive_float, positive_int
from jaxsph.environment import environment
from jaxsph.integrate import integrate
from jaxsph.pairs import pair_sum_p
from jaxsph.scenes import Scene, lid_driven_cavity, taylor_green, taylor_green_3d
from jaxsph_rom.points import QuadraticSystem
from jaxsph_rom.points.prediction.sweep import batch_of
from jaxsph_rom.points.prediction.times import EvenTimes

from .measure import write_json
from .table import command

DTYPES = ("float32", "float64")
_BOUND = 1e-12  # of the largest value, in double precision: a rate sums some hundred summands
_STEPS = 20  # of an interval that is timed
_MODES, _TENSOR_STEPS = 20, 100
_REPEATS = 3


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: results that are not the CPU's, 2: bad input."""
    return command("device_check", __doc__, _arguments, _run, argv, "device_check_local.json")


def _arguments(add) -> None:
    add("--sides", type=positive_int, nargs="+", default=[1000, 316, 2000], metavar="N",
        help="particles per side in two dimensions (default: 1000 316 2000)")  # fmt: skip
    add("--sides-3d", type=positive_int, nargs="*", default=[100, 46], metavar="N",
        help="in three (default: 100 46)")  # fmt: skip
    add("--dtypes", nargs="+", default=list(DTYPES), choices=DTYPES, help="(default: both)")
    add("--vortex", type=positive_int, default=100, metavar="N",
        help="particles per side of a vortex run to its end (default: 100)")  # fmt: skip
    add("--members", type=positive_int, default=100_000, metavar="K",
        help="of a tensor model (default: 100000)")  # fmt: skip
    add("--end-time", type=positive_float, default=1.0, metavar="S",
        help="of the vortex [s] (default: 1)")  # fmt: skip
    add("--budget", type=positive_float, default=220.0, metavar="S",
        help="begin no case after so long [s] (default: 220)")  # fmt: skip


def _run(options) -> int:
    start = clock.perf_counter()
    results: dict[str, Any] = {"environment": environment(), "rows": [], "left_out": 0}
    results["differences"] = differences()
    results["bandwidth"] = bandwidth()
    worst = max(results["differences"].values())
    print(f"{jax.devices()[0].device_kind}: at most {worst:.1e} from the CPU", file=sys.stderr)
    for case in _cases(options):
        if clock.perf_counter() - start > options.budget:
            results["left_out"] += 1
            continue
        for row in case():
            results["rows"].append(row)
            print(row, file=sys.stderr, flush=True)
        write_json(options.json, results)
    write_json(options.json, results)
    return int(not worst <= _BOUND)


def _cases(options) -> Iterator[Callable[[], Iterator[dict]]]:
    scenes = [(taylor_green, 2.0, side) for side in options.sides]
    scenes[1:1] = [(taylor_green_3d, 1.3, side) for side in options.sides_3d]
    for number, dtype in enumerate(options.dtypes):
        for scene in scenes:
            yield partial(of_scene, *scene, dtype)
        if number == 0:
            yield partial(of_tensors, options.members)
            yield partial(of_vortex, options.vortex, options.end_time)


# ------------------------------------------------------------------ correctness


def differences() -> dict[str, float]:
    """Of rates and gradients of small states from the CPU's, the largest over the largest value."""
    jittered = JitteredLattice(0.2)
    scenes = {
        "vortex": taylor_green(16, arrangement=jittered),
        "vortex in space": taylor_green_3d(11, arrangement=jittered),
        "cavity": lid_driven_cavity(12, arrangement=jittered),
        "members": taylor_green(12, arrangement=jittered),
    }
    found = {}
    for name, scene in scenes.items():
        function = _program(scene, scene.model(), 2 if name == "members" else 1)
        here, there = (
            np_tree(jax.jit(function)(*jax.device_put((scene.state,), device)))
            for device in (jax.devices()[0], jax.devices("cpu")[0])
        )
        found[name] = difference(here, there)
    return found


def _program(scene: Scene, model, members: int) -> Callable:
    """The gradient of a sum over rates, and these, of members at once where there are several."""
    time = jnp.zeros((), scene.state.density.dtype)

    def total(state):
        rates = model.rates(time, state, model.prepare(state))
        return sum(jnp.sum(rate * rate) for rate in jax.tree.leaves(rates)), rates

    if members == 1:
        return jax.grad(total, has_aux=True)
    stack = partial(jax.tree.map, lambda a: jnp.stack([a] * members))
    return lambda state: jax.vmap(jax.grad(total, has_aux=True))(stack(state))


def np_tree(tree):
    return jax.tree.map(np.asarray, tree)


def difference(found, exact) -> float:
    """The largest of all leaves, each over its largest value; infinite where one is not finite."""
    worst = 0.0
    for a, b in zip(jax.tree.leaves(found), jax.tree.leaves(exact), strict=True):
        off = np.max(np.abs(a - b)) / (np.max(np.abs(b)) or 1.0)
        worst = max(worst, float(off) if np.isfinite(off) else np.inf)
    return worst


# ------------------------------------------------------------------ times


def of_scene(make, h_over_dx: float, side: int, dtype: str) -> Iterator[dict[str, Any]]:
    """List, right-hand side, gradient and step of a vortex."""
    scene = make(side, 1e6, arrangement=Lattice(), dtype=dtype, h_over_dx=h_over_dx)
    model, state = scene.model(), scene.state
    time = jnp.zeros((), state.density.dtype)
    step = jnp.asarray(scene.time_step, time.dtype)
    case = {"dim": scene.space.box.dim, "particles": len(state.density), "dtype": dtype}

    def rates(state, lists):
        return model.rates(time, state, lists)

    def total(state, lists):
        return sum(jnp.sum(rate * rate) for rate in jax.tree.leaves(rates(state, lists)))

    def interval(state):
        return integrate(model, state, jnp.zeros((), jnp.int32), step, _STEPS, 1)[0]

    lists, seconds, first = timed(lambda x: model.search.build(x), state.position)
    yield case | {"program": "list", "seconds": seconds, "first_seconds": first}
    for name, function in (("right-hand side", rates), ("gradient", jax.grad(total))):
        _, seconds, first = timed(function, state, lists)
        floor = bytes_of(function, state, lists) / bandwidth()
        timings = {"seconds": seconds, "floor_seconds": floor, "first_seconds": first}
        yield case | {"program": name} | timings
    _, seconds, first = timed(interval, state)
    yield case | {"program": "step", "seconds": seconds / _STEPS, "first_seconds": first}


def of_tensors(members: int) -> Iterator[dict[str, Any]]:
    """Members of a tensor model, in one batch."""
    rng, dtype = np.random.default_rng(0), jnp.float32
    linear = rng.normal(size=(_MODES, _MODES))
    terms = (np.zeros((2, _MODES)), np.stack([linear - linear.T, -np.eye(_MODES)]))
    quadratic = 0.01 * rng.normal(size=(_MODES,) * 3)
    system = QuadraticSystem(*(jnp.asarray(a, dtype) for a in (*terms, quadratic)))
    times = EvenTimes(jnp.asarray(0.01, dtype), _TENSOR_STEPS, 1)
    starts = jnp.asarray(0.1 * rng.normal(size=(members, _MODES)), dtype)
    values = jnp.full(members, 0.5, dtype)
    (found, code, _), seconds, first = timed(
        lambda starts, values: batch_of(system, None, times, starts, values), starts, values
    )
    alone = batch_of(system, None, times, starts[:1], values[:1])[0]
    yield {
        "program": "tensors", "members": members, "modes": _MODES, "steps": _TENSOR_STEPS,
        "seconds": seconds, "first_seconds": first, "failed": int(np.sum(np.asarray(code) != 0)),
        "first_from_alone": difference(np.asarray(found[:1]), np.asarray(alone)),
    }  # fmt: skip


def of_vortex(side: int, end_time: float) -> Iterator[dict[str, Any]]:
    """A vortex from start to end, beside the exact decay of its kinetic energy."""
    scene = taylor_green(side, 100.0, dtype="float32", arrangement=Lattice(), end_time=end_time)
    run = run_scene(scene)
    before, after = (np.square(run.velocity[k]).sum(axis=1).mean() for k in (0, -1))
    exact = np.asarray(scene.exact(jnp.asarray(run.position[-1]), float(run.time[-1]))[0])
    yield {
        "program": "vortex", "particles": side**2, "steps": run.metadata["steps"],
        "seconds": run.metadata["run_seconds"], "first_seconds": run.metadata["compile_seconds"],
        "energy": float(after / before),
        "exact_energy": float(np.square(exact).sum(axis=1).mean() / before),
    }  # fmt: skip


def timed(function: Callable, *arguments) -> tuple[Any, float, float]:
    """The result, the least of some times [s], and that of the first call, compilation in it."""
    program = jax.jit(function, compiler_options=platform_options())
    seconds = []
    for _ in range(1 + _REPEATS):
        start = clock.perf_counter()
        found = jax.block_until_ready(program(*arguments))
        seconds.append(clock.perf_counter() - start)
    return found, min(seconds[1:]), seconds[0]


@cache
def bandwidth(count: int = 2**26) -> float:
    """Bytes a second of a copy, read and written, of 256 MiB on a GPU."""
    count = count if jax.default_backend() != "cpu" else 2**20
    values = jnp.zeros(count, jnp.float32)
    return 2.0 * values.nbytes / timed(lambda a: a + 1.0, values)[1]


def bytes_of(function: Callable, *arguments) -> int:
    """What the pair sums of a function read and write, each array once."""

    def of(jaxpr) -> int:
        found = 0
        for equation in jaxpr.eqns:
            if equation.primitive is pair_sum_p:
                ends = (*equation.invars, *equation.outvars)
                found += sum(end.aval.size * end.aval.dtype.itemsize for end in ends)
            found += sum(map(of, jaxprs_in_params(equation.params)))
        return found

    return of(jax.make_jaxpr(function)(*arguments).jaxpr)


if __name__ == "__main__":
    sys.exit(main())
