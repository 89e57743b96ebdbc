"""Runs kept on disk: done once, and taken up again where they were cut short."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import jax

from jaxsph import Trajectory, simulate
from jaxsph.integrate import Model
from jaxsph.io import TrajectoryWriter, read_checkpoint, read_trajectory
from jaxsph.scenes import Scene

# label, steps in all, steps done -> context manager that gives a function to report steps to
Progress = Callable[[str, int, int], AbstractContextManager[Callable[[int], None]]]


def recorded_run(
    path: Path,
    scene: Scene,
    model: Callable[[], Model],
    start: Callable[[Model], Any],
    restore: Callable[[Trajectory], Any],
    label: str,
    progress: Progress,
) -> Trajectory:
    """The trajectory in the file at `path`, run as far as it is not there yet.

    A file whose recorded parameters differ from the scene's is replaced.

    Args:
        path: of the trajectory file.
        scene: its steps, and its parameters as they are recorded.
        model: makes the model, if there is anything left to run.
        start: makes the initial state from the model.
        restore: makes the state from the last snapshot of a trajectory.
        label: for the progress bar.
        progress: opens a progress bar.

    Raises:
        SimulationError: on a fault; the file then holds the good snapshots.
    """
    done = _steps_done(path, scene)
    if done == scene.steps:
        return read_trajectory(path)
    made = model()
    if done:
        state, writer = restore(read_trajectory(path)), TrajectoryWriter.append_to(path)
    else:
        state = start(made)
        coordinates = jax.eval_shape(made.observe, state).coordinates
        modes = None if coordinates is None else coordinates.shape[0]
        writer = TrajectoryWriter.create(path, scene, modes=modes, overwrite=True)
    with progress(label, scene.steps, done) as report, writer:
        part = simulate(
            made,
            state,
            time_step=scene.time_step,
            steps=scene.steps,
            steps_per_snapshot=scene.steps_per_snapshot,
            first_step=done,
            recorder=writer,
            progress=report,
            metadata={"scene": scene.name, "parameters": scene.parameters},
        )
        writer.finish(part.metadata)
    return read_trajectory(path)


def _steps_done(path: Path, scene: Scene) -> int:
    """Steps recorded of exactly this run; 0 if there are none."""
    if not path.exists():
        return 0
    found = read_checkpoint(path)
    wanted = json.loads(json.dumps(scene.parameters))
    if found.scene != scene.name or found.parameters != wanted or found.steps != scene.steps:
        return 0
    return max(found.step, 0)


def full_run(folder: Path, scene: Scene, progress: Progress) -> Trajectory:
    """The full model's trajectory, kept in `folder`."""
    reynolds = scene.parameters["reynolds"]

    return recorded_run(
        folder / f"re-{reynolds:g}" / "trajectory.h5",
        scene,
        scene.model,
        lambda _: scene.state,
        lambda trajectory: trajectory.state(-1),
        f"full model, Re {reynolds:g}",
        progress,
    )


def with_record(scene: Scene, **settings: Any) -> Scene:
    """The scene with more settings in its recorded parameters."""
    return dataclasses.replace(scene, parameters={**scene.parameters, **settings})
