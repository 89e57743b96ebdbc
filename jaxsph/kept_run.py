"""Runs kept in files: done once, and taken up again where they were cut short."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

import jax

from .content import content
from .devices import Devices
from .integrate import Model
from .io import TrajectoryFileError, TrajectoryWriter, read_checkpoint, read_trajectory
from .simulate import first_doubt, simulate
from .trajectory import Trajectory


def kept_run(
    path: str | os.PathLike,
    scene: Any,
    model: Callable[[], Model],
    start: Callable[[Model], Any],
    restore: Callable[[Trajectory], Any],
    progress: Callable[[int], AbstractContextManager[Callable[[int], None] | None]],
    made_by: Mapping[str, Any] | None = None,
    **options: Any,
) -> Trajectory:
    """The trajectory in the file at `path`, run as far as it is not there yet.

    Where `devices` of several processes run it, all of these see the file, and one writes it.

    Args:
        path: of the trajectory file.
        scene: its schedule, and its parameters as they are recorded.
        model: makes the model, if there is anything left to run.
        start: makes the initial state from the model.
        restore: makes the state from the last snapshot of a trajectory.
        progress: opens, from the steps done before, what is told of steps as they are done.
        made_by: what else makes the run, beside the scene.
        options: of `simulate`.

    Raises:
        TrajectoryFileError: if the file holds another run, or another process writes it; it stays
            as it is.
        SimulationError: on a fault; the file then holds the good snapshots.
    """
    path = Path(path)
    wanted = {**(content({"made_by": made_by}) if made_by else {}), **content(scene)}
    done = steps_done(path, wanted)
    if done == scene.steps:
        return _whole(path, scene)
    made = model()
    metadata = {"scene": scene.name, "parameters": scene.parameters}
    given = options.get("devices")
    devices = Devices(jax.local_devices()[:1] if given is None else given)
    options |= {} if given is None else {"devices": devices}  # which may be read but once
    begun = read_trajectory(path) if done else None
    devices.meet()  # all have looked at the file as it was
    if done:
        writer = devices.by_first(lambda: _gone_on_with(path, begun))
        state = restore(begun)
        if options.get("watch") is not None:
            metadata |= first_doubt(options["watch"], begun)
    else:
        state = start(made)
        writer = devices.by_first(
            lambda: _begun(path, scene, made, state, done is not None, wanted, options)
        )
    with writer or nullcontext(), progress(done or 0) as report:
        part = simulate(
            made,
            state,
            scene.schedule,
            first_step=done or 0,
            recorder=writer,
            progress=report,
            metadata=metadata,
            **options,
        )
        devices.by_first(lambda: _ended(writer, part.metadata))
    return _whole(path, scene)


def _ended(writer: TrajectoryWriter, metadata: dict) -> None:
    writer.finish(metadata)
    writer.close()


def _gone_on_with(path: Path, begun: Trajectory) -> TrajectoryWriter:
    """A writer of the file that held so much when it was read."""
    writer = TrajectoryWriter.append_to(path)
    if writer.last_step != begun.metadata["steps"]:
        writer.close()
        raise _disturbed(path)
    return writer


def _begun(path: Path, scene, made: Model, state, overwrite: bool, wanted, options):
    """A writer of a new file for a run from that state."""
    coordinates = jax.eval_shape(made.observe, state).coordinates
    return TrajectoryWriter.create(
        path,
        scene,
        modes=None if coordinates is None else coordinates.shape[0],
        made_by=wanted,
        overwrite=overwrite,
        forces=options.get("measure"),
        averaged=options.get("averaged"),
    )


def steps_done(path: Path, wanted: Mapping[str, str]) -> int | None:
    """Steps that a file holds of the run of that content; None if there is no file.

    Raises:
        TrajectoryFileError: naming what differs, if the file holds another run.
    """
    if not path.exists():
        return None
    found = read_checkpoint(path)
    found.check(path, wanted)
    return max(found.step, 0)


def _whole(path: Path, scene: Any) -> Trajectory:
    """The trajectory in a file, which must be all of the scene's run."""
    trajectory = read_trajectory(path)
    if len(trajectory.time) != scene.schedule.intervals + 1:
        raise _disturbed(path)
    return trajectory


def _disturbed(path: Path) -> TrajectoryFileError:
    return TrajectoryFileError(
        f"{path}: was written by another process in between; repeat the call once that has ended."
    )
