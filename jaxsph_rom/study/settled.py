"""Scenes that start where a run from rest has settled."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from pathlib import Path

from jaxsph.scenes import Scene, continued

from .recorded_run import Progress, full_run

_SNAPSHOTS = 50  # kept of the time before
_COARSEST = 80  # particles along the longest side at half the resolution, at least
_COARSE_SHARE = 0.8  # of the time that may run at half the resolution


def settled(
    make: Callable[..., Scene], settling: float, folder: Path, progress: Progress
) -> Callable[[float], Scene]:
    """Scenes of a Reynolds number whose particles are those of a run from rest, after a time.

    Where half the resolution still resolves the flow, four fifths of that time are run with it, at
    an eighth of the price in two dimensions, and the rest goes on from there (`continued`). The
    runs are kept in `folder` and taken up again where they were cut short.

    Args:
        make: a scene from a Reynolds number, the setting `start_time` and, for the runs before,
            `end_time`, `time_step` and `resolution`.
        settling: length of the run from rest [s].
        folder: where it is kept.
        progress: opens a progress bar.
    """

    def before(reynolds: float, start_time: float, end_time: float, **more) -> Scene:
        given = {"reynolds": reynolds, "start_time": start_time, "end_time": end_time - start_time}
        free = make(**given, **more)
        each = math.ceil(free.steps / _SNAPSHOTS)
        step = given["end_time"] / (each * _SNAPSHOTS)
        return dataclasses.replace(make(**given, **more, time_step=step), steps_per_snapshot=each)

    def scene(reynolds: float) -> Scene:
        start = make(reynolds=reynolds, start_time=settling)
        half = 4 * (start.parameters["resolution"] // 8)  # a multiple of four fits all scenes
        if half < _COARSEST:
            last = before(reynolds, 0.0, settling)
        else:
            changed = _COARSE_SHARE * settling
            coarse = before(reynolds, 0.0, changed, resolution=half)
            run = full_run(folder / f"resolution-{half}", coarse, progress)
            last = before(reynolds, changed, settling)
            last = continued(last, run.state(-1), coarse.space)
        return dataclasses.replace(start, state=full_run(folder, last, progress).state(-1))

    return scene
