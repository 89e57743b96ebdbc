"""Hard cases of reduced models on reference points, whose equations are quadratic."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from jaxsph import Trajectory
from jaxsph.arrangements import Lattice
from jaxsph.integrate import FaultCode
from jaxsph_rom.points import ReducedFlow, mapped_run

from .bounds import DECAY, LOOSE_DENSITY
from .judge import Case, Ending, Run
from .reduced_cases import full_run

_TIMES_TRAINED = 10  # how much longer than the run that the basis is of
_BOUNDED = (LOOSE_DENSITY, DECAY)


@cache
def _flow() -> tuple[ReducedFlow, np.ndarray]:
    """A flow of as many modes as snapshots, and the fields (r, u) that its runs start from."""
    scene, run = full_run()
    points = Lattice().positions(scene.space)
    flow = ReducedFlow.train(scene, [run], points, len(run.time))
    return flow, mapped_run(flow.reference, run, scene.fluid)[..., 0]


def _predicted(modes: int | None, reynolds: float, change: Callable | None = None) -> Run:
    """A reduced run ten times as long as the full one, seen on the reference points."""
    scene, run = full_run()
    flow, first = _flow()
    flow = flow if modes is None else flow.truncated(modes)
    flow = flow if change is None else change(flow)
    schedule = replace(scene.schedule, intervals=_TIMES_TRAINED * (len(run.time) - 1))

    def predict() -> Trajectory:
        start = flow.project(first)
        viscosity = jnp.asarray(1.0 / reynolds)
        found = flow.predict(start, viscosity, schedule)
        return flow.fields(jnp.concatenate([start[None], found]), schedule.times)

    return Run(scene, schedule, predict=predict)


def _quadratic_times(factor: float, flow: ReducedFlow) -> ReducedFlow:
    """The flow with a quadratic part that creates energy."""
    quadratic = flow.system.quadratic
    return eqx.tree_at(lambda f: f.system.quadratic, flow, jnp.abs(quadratic) * factor)


_NAMED = {"endings": (Ending.FAULT,), "says": "not finite|more energy"}

ON_REFERENCE_POINTS = (
    *(Case(f"tensor/{name}", f"{what}, ten times the time trained on",
           partial(_predicted, modes, 100.0), _BOUNDED)
      for name, what, modes in (("one-mode", "M = 1", 1), ("all-modes", "M = 21", None))),
    Case("tensor/re-1e6", "M = 21 at Re = 1e6, trained on Re = 100",
         partial(_predicted, None, 1e6), _BOUNDED, endings=(Ending.FINISHED, Ending.FAULT),
         says="more energy"),
    Case("tensor/negative-viscosity", "a viscosity that drives the flow",
         partial(_predicted, None, -10.0), **_NAMED,
         codes=(FaultCode.ENERGY_OUT_OF_BOUNDS, FaultCode.NOT_FINITE)),
    Case("tensor/nan-viscosity", "a viscosity that is NaN",
         partial(_predicted, None, np.nan), **_NAMED, codes=(FaultCode.NOT_FINITE,)),
    Case("tensor/blow-up", "a quadratic part that creates energy",
         partial(_predicted, None, 100.0, partial(_quadratic_times, 10.0)), **_NAMED,
         codes=(FaultCode.ENERGY_OUT_OF_BOUNDS, FaultCode.NOT_FINITE)),
)  # fmt: skip
