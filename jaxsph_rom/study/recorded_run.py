"""Full runs of scenes, kept in a folder."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from jaxsph import Trajectory
from jaxsph.content import digest
from jaxsph.kept_run import kept_run
from jaxsph.scenes import Scene

# label, steps in all, steps done -> context manager that gives a function to report steps to
Progress = Callable[[str, int, int], AbstractContextManager[Callable[[int], None]]]


def full_run(
    folder: Path, scene: Scene, progress: Progress, name: str | None = None
) -> Trajectory:
    """The full model's trajectory, kept in `folder`.

    Args:
        folder: of all runs.
        scene: to run.
        progress: opens a progress bar.
        name: of the run; its Reynolds number, or what tells the scene, if none is given.

    Raises:
        TrajectoryFileError: if another scene's run is kept there in its place.
        SimulationError: on a fault; the file then holds the good snapshots.
    """
    reynolds = scene.parameters.get("reynolds")
    short = f"{scene.name}-{digest(scene)[1:9]}" if reynolds is None else f"re-{reynolds:g}"
    told = name or (scene.name if reynolds is None else f"Re {reynolds:g}")
    return kept_run(
        folder / (name or short).replace(" ", "_") / "trajectory.h5",
        scene,
        scene.model,
        lambda _: scene.state,
        lambda trajectory: trajectory.state(-1),
        lambda done: progress(f"full model, {told}", scene.steps, done),
    )


def with_record(scene: Scene, **settings: Any) -> Scene:
    """The scene with more settings in its recorded parameters."""
    return dataclasses.replace(scene, parameters={**scene.parameters, **settings})
