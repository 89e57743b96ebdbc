"""Whether a run is that of a scene."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from jaxsph import Trajectory, simulate
from jaxsph.scenes import Scene

_SAME_START = 1e-4  # of the spacing, of the reference speed, of the density: float32 and more
_SAME_STEP = 0.02  # of the change in a first interval: another machine's round-off is far less


def check_runs(
    scenes: Sequence[Scene], runs: Sequence[Trajectory], named: Callable[[int], str]
) -> None:
    """A ValueError if runs are not those of the scenes, one each and in their order.

    Times, particles and the start must be the scene's, and so must the record of its parameters
    where there is one. Where the records of two scenes are the same, the first interval is run
    again.

    Args:
        scenes: of the family.
        runs: of the full model.
        named: what the scene of a number is called.
    """
    if len(runs) != len(scenes):
        raise ValueError(f"runs: {len(runs)} of them for {len(scenes)} sets of parameters.")
    records = [_record(scene.parameters) for scene in scenes]
    for k, (scene, run) in enumerate(zip(scenes, runs, strict=True)):
        wanted = scene.schedule.times
        if len(run.time) != len(wanted) or not np.allclose(run.time, wanted, rtol=1e-5, atol=0.0):
            last = float(run.time[-1]) if len(run.time) else 0.0
            raise ValueError(
                f"runs: number {k} has {len(run.time)} snapshots to t = {last:g} s, the scene of "
                f"{named(k)} {len(wanted)} to {scene.end_time:g} s; give the whole run "
                "with all of them."
            )
        recorded = run.metadata.get("parameters")
        if recorded is not None and _record(recorded) != records[k]:
            other = [j for j, record in enumerate(records) if record == _record(recorded)]
            what = f"is that of {named(other[0])}" if other else "has another record"
            raise ValueError(
                f"runs: number {k} {what}, not of {named(k)}; give runs in the parameters' order."
            )
        _check_start(scene, run, k, named)
        if recorded is None or records.count(records[k]) > 1:
            _check_first_interval(scene, run, k, named)


def _check_start(scene: Scene, run: Trajectory, k: int, named) -> None:
    state, fluid = scene.state, scene.fluid
    scales = scene.space.spacing, float(fluid.reference_speed), float(fluid.reference_density)
    for name, scale in zip(("position", "velocity", "density"), scales, strict=True):
        wanted, found = np.asarray(getattr(state, name)), getattr(run, name)[0]
        if found.shape != wanted.shape or np.abs(found - wanted).max() > _SAME_START * scale:
            raise ValueError(
                f"runs: number {k} starts at another {name} than the scene of {named(k)}; make it "
                "with that scene."
            )


def _check_first_interval(scene: Scene, run: Trajectory, k: int, named) -> None:
    again = simulate(scene.model(), scene.state, dataclasses.replace(scene.schedule, intervals=1))
    change = np.abs(again.velocity[1] - again.velocity[0]).max()
    apart = np.abs(again.velocity[1] - run.velocity[1]).max()
    least = 1e-6 * float(scene.fluid.reference_speed)
    if apart > _SAME_STEP * change + least:
        raise ValueError(
            f"runs: number {k} does not move as the scene of {named(k)} does; give runs in the "
            "parameters' order, and of these scenes."
        )


def _record(parameters: dict[str, Any]) -> dict[str, Any]:
    """As a file has it; 50 and 50.0 are the same number."""

    def plain(value):
        return value.item() if hasattr(value, "item") else str(value)

    return json.loads(json.dumps(parameters, default=plain))
