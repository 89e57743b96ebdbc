"""Seconds of a version's own calls, in a process of it: the cases are asked for, one a line."""

from __future__ import annotations

import json
import sys
import time as clock
from collections.abc import Callable

import jax
import numpy as np

_MEMBERS = 10_000
STEPS = 10  # in one go, from the start
_LENGTH = 0.5  # s, for which a cheap call is repeated


def main() -> None:
    """Seconds of the cases that are asked for, one a line."""
    jax.config.update("jax_enable_x64", True)
    made: dict[str, Callable[[], object]] = {}
    counted: dict[str, int | None] = {}
    for line in sys.stdin:
        case = line.strip()
        if case not in made:
            made[case] = _call(case)
            jax.block_until_ready(made[case]())  # compiled
        start, least, busy = clock.perf_counter(), np.inf, np.inf
        while least == np.inf or clock.perf_counter() - start < _LENGTH:
            before, process = clock.perf_counter(), clock.process_time()
            jax.block_until_ready(made[case]())
            least = min(least, clock.perf_counter() - before)
            busy = min(busy, clock.process_time() - process)
        rebuilds = _rebuilds(case) if case not in counted and "steps" in case else None
        counted.setdefault(case, rebuilds)
        found = {"seconds": least, "cpu_seconds": busy, "rebuilds": counted[case]}
        print(json.dumps(found), flush=True)


def _call(case: str) -> Callable[[], object]:
    import jaxsph
    from jaxsph.schemes import DeltaPlus

    if "right-hand side" in case:
        make = {"p": jaxsph.scenes.taylor_green, "w": jaxsph.scenes.lid_driven_cavity}[case[0]]
        scene = make(100, scheme=DeltaPlus())
        neighbors = scene.search().build(scene.state.position)
        rates = jax.jit(
            lambda f, s, n: f(0.0, s, n), compiler_options=jaxsph.COMPILER_OPTIONS
        )  # fmt: skip
        arguments = scene.functional(), scene.state, neighbors
        return lambda: rates(*arguments)
    if case.endswith(("list", "steps")):
        return _list_or_steps(case)
    predict = _trained()
    if case == "sweep":
        return lambda: predict(np.linspace(100.0, 200.0, _MEMBERS))
    return lambda: predict(np.array([150.0]))


def _flow(case: str):
    """The scene that a case names by its kind and its number of particles: `vortex 10000 list`."""
    import jaxsph

    kind, count, _ = case.split()
    side = round(int(count) ** 0.5)
    if kind == "vortex":
        return jaxsph.scenes.taylor_green(side)
    if kind == "cavity":
        return jaxsph.scenes.lid_driven_cavity(side)
    return jaxsph.scenes.dam_break(round(side * 12.5**0.5))  # 2 / 15 of its tank of 5 a by 3 a


def _list_or_steps(case: str) -> Callable[[], object]:
    """The neighbour list at the start, or some steps with their lists as `simulate` takes them."""
    import equinox as eqx

    from jaxsph import COMPILER_OPTIONS
    from jaxsph.integrate import FixedSteps
    from jaxsph.simulate import _interval

    scene = _flow(case)
    model, state = scene.model(), scene.state
    if case.endswith("list"):
        compiled = eqx.filter_jit(
            lambda search, x: search.build(x), compiler_options=COMPILER_OPTIONS
        )  # fmt: skip
        return lambda: compiled(model.search, state.position)
    step = jax.numpy.asarray(scene.time_step)
    return lambda: _interval(model, state, np.int32(0), step, STEPS, FixedSteps())[0]


def _rebuilds(case: str) -> int:
    """Lists built in these steps, the first included."""
    import equinox as eqx

    from jaxsph.integrate import rk4_step

    scene = _flow(case)
    model, state = scene.model(), scene.state
    dt = jax.numpy.asarray(scene.time_step)

    @eqx.filter_jit
    def step(model, state, old, number):
        time = number * dt
        new = model.at(time).refresh(old, state, dt)
        state = rk4_step(lambda t, y: model.rates(t, y, new), time, state, dt)
        built = jax.numpy.any(new.reference != old.reference)
        return model.finish(state), new, built

    neighbors, count = eqx.filter_jit(lambda m, s: m.prepare(s))(model, state), 1
    for number in range(STEPS):
        state, neighbors, built = step(model, state, neighbors, jax.numpy.asarray(float(number)))
        count += int(built)
    return count


def _trained() -> Callable[[np.ndarray], object]:
    """Ten modes of two runs, as a function of Reynolds numbers."""
    import jaxsph
    import jaxsph_rom
    from jaxsph.schemes import DeltaPlus

    def make(reynolds):
        return jaxsph.scenes.taylor_green(24, reynolds, end_time=0.5, scheme=DeltaPlus())

    if not hasattr(jaxsph_rom, "train"):  # before it took any parameters
        from jaxsph_rom.hyper import train_flows

        scenes = [make(reynolds) for reynolds in (100.0, 200.0)]
        (flow,) = train_flows(scenes, [jaxsph.run_scene(scene) for scene in scenes], (10,))
        return lambda reynolds: flow.predict(reynolds).coordinates
    trained = jaxsph_rom.train(make, [{"reynolds": 100.0}, {"reynolds": 200.0}], modes=10)
    return lambda reynolds: trained.predict({"reynolds": reynolds}).coordinates


if __name__ == "__main__":
    main()
