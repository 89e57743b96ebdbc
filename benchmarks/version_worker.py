"""Seconds of a version's own calls, in a process of it: the cases are asked for, one a line."""

from __future__ import annotations

import json
import sys
import time as clock
from collections.abc import Callable

import jax
import numpy as np

_MEMBERS = 10_000
_LENGTH = 0.5  # s, for which a cheap call is repeated


def main() -> None:
    """Seconds of the cases that are asked for, one a line."""
    jax.config.update("jax_enable_x64", True)
    made: dict[str, Callable[[], object]] = {}
    for line in sys.stdin:
        case = line.strip()
        if case not in made:
            made[case] = _call(case)
            jax.block_until_ready(made[case]())  # compiled
        start, least = clock.perf_counter(), np.inf
        while least == np.inf or clock.perf_counter() - start < _LENGTH:
            before = clock.perf_counter()
            jax.block_until_ready(made[case]())
            least = min(least, clock.perf_counter() - before)
        print(json.dumps({"seconds": least}), flush=True)


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
    predict = _trained()
    if case == "sweep":
        return lambda: predict(np.linspace(100.0, 200.0, _MEMBERS))
    return lambda: predict(np.array([150.0]))


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
