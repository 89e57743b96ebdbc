"""Scenes that start where a run from rest has settled."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from pathlib import Path

import jax.numpy as jnp

from jaxsph import ParticleState
from jaxsph.scenes import Scene

from .recorded_run import Progress, full_run

_SNAPSHOTS = 50  # kept of the time before


def settled(
    make: Callable[..., Scene], settling: float, folder: Path, progress: Progress
) -> Callable[[float], Scene]:
    """Scenes of a Reynolds number whose particles are those of a run from rest, after a time.

    The run from rest is kept in `folder` and taken up again where it was cut short.

    Args:
        make: a scene from a Reynolds number and the settings `start_time` and, for the run from
            rest, `end_time`.
        settling: length of the run from rest [s].
        folder: where it is kept.
        progress: opens a progress bar.
    """

    def scene(reynolds: float) -> Scene:
        rest = make(reynolds=reynolds, start_time=0.0, end_time=settling)
        each = math.ceil(rest.steps / _SNAPSHOTS)
        step = settling / (each * _SNAPSHOTS)
        rest = make(reynolds=reynolds, start_time=0.0, end_time=settling, time_step=step)
        rest = dataclasses.replace(rest, steps_per_snapshot=each)
        before = full_run(folder, rest, progress)
        fields = (before.position, before.velocity, before.density)
        state = ParticleState(*(jnp.asarray(field[-1]) for field in fields))
        return dataclasses.replace(make(reynolds=reynolds, start_time=settling), state=state)

    return scene
