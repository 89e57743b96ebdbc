"""The Taylor-Green vortex that reduced models on reference points are measured by."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxsph import SimulationError, Trajectory
from jaxsph.arrangements import Lattice, Stirred
from jaxsph.metrics import centre_line, probe, relative_discrepancy
from jaxsph.scenes import Scene, taylor_green
from jaxsph.schemes import DeltaPlus
from jaxsph_rom.points import ReducedFlow
from jaxsph_rom.study import quiet

from .measure import repeated, summary, tell

TRAINED_ON = (100.0, 150.0, 200.0, 250.0)
HELD_BACK = 200.0
PREDICTED = (110.0, 125.0, 175.0, 225.0, 240.0)  # 110 and 240: no choice was made by them
_REPEATS = 5


def make_scene(options, reynolds: float, time_step: float | None = None) -> Scene:
    """Stirred particles at a balanced pressure."""
    scene = taylor_green(
        options.resolution,
        reynolds,
        scale=options.scale,
        end_time=options.end_time,
        time_step=time_step,
        arrangement=Stirred(),
        scheme=DeltaPlus(),
        dtype="float64",
    )
    return quiet(scene)


def train(scene: Scene, runs: list[Trajectory], modes: int) -> ReducedFlow:
    """A reduced flow on a lattice of reference points."""
    tell(f"training, M = {modes}")
    flow = ReducedFlow.train(scene, runs, Lattice().positions(scene.space), modes)
    return jax.block_until_ready(flow)


def profile_of(scene: Scene, run: Trajectory):
    return probe(run, centre_line(scene.space), scene.space)


def judged(flow: ReducedFlow, scene: Scene, run: Trajectory, projected, truth) -> dict[str, Any]:
    """Errors on the centre line, the projection's own as a floor, and times."""
    viscosity = 1.0 / scene.parameters["reynolds"]
    first = jnp.asarray(projected[0])
    first_seconds, seconds, fault, found = None, [], None, None
    try:
        found, first_seconds, seconds = repeated(
            lambda: flow.predict(first, viscosity, scene.schedule), _REPEATS
        )
    except SimulationError as error:
        fault = str(error)
    timing = run.timing
    row = {
        "stable": fault is None,
        "fault": fault,
        "rom_compile_and_first_seconds": first_seconds,
        "rom_seconds": summary(seconds),
        "fom_seconds": timing.seconds(scene.steps),
        "steps": scene.steps,
    }
    line = centre_line(scene.space)

    def profile(coordinates):
        fields = flow.fields(coordinates, run.time, line)
        return np.linalg.norm(fields.velocity, axis=2), fields.pressure

    row |= discrepancies("floor_", truth, profile(jnp.asarray(projected)))
    if found is not None:
        row |= discrepancies("", truth, profile(jnp.concatenate([first[None], found])))
    return row


def discrepancies(prefix: str, truth, found) -> dict[str, float]:
    """Peak and median over time of the discrepancy of velocity norm and pressure."""
    row = {}
    for name, a, b in zip(("velocity", "pressure"), truth, found, strict=True):
        over_time = relative_discrepancy(a, b)
        row[f"{prefix}{name}_peak_percent"] = float(over_time.max())
        row[f"{prefix}{name}_median_percent"] = float(np.median(over_time))
    return row
