"""Trajectories in memory, written to files."""

from __future__ import annotations

import math
import os
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from ..schedule import Schedule
from ..trajectory import Trajectory
from .trajectory_writer import TrajectoryWriter


def save_trajectory(
    trajectory: Trajectory, path: str | os.PathLike, overwrite: bool = False
) -> Path:
    """Write all snapshots to a trajectory file; see `Trajectory.save`.

    Args:
        trajectory: with a snapshot at least.
        path: of the file; folders are made as needed.
        overwrite: whether an existing file may be replaced.

    Raises:
        ValueError: if times do not increase.
        TrajectoryFileError: if the file exists, or cannot be written.
    """
    metadata, time = trajectory.metadata, np.asarray(trajectory.time, np.float64)
    intervals = np.diff(time)
    if not len(time) or not np.all(intervals > 0.0):
        raise ValueError("time: a file needs snapshots at times that increase.")
    shortest = intervals.min() if len(intervals) else 1.0
    time_step = min(float(metadata.get("time_step", shortest)), shortest)
    steps = np.rint(time / time_step).astype(int)  # differ, as no interval is below a step
    each = max(1, int(np.gcd.reduce(steps)))  # where times are even: from snapshot to snapshot
    record = SimpleNamespace(
        name=str(metadata.get("scene", "trajectory")),
        parameters=metadata.get("parameters", {}),
        effects=(),
        mass=None,
        parking=trajectory.active is not None or None,
        state=trajectory.state(0),
        schedule=Schedule(time_step, each, int(steps[-1]) // each),
    )
    names = tuple(trajectory.forces)
    unknown = (math.nan,) * len(names)  # what coefficients refer to
    forces = SimpleNamespace(
        names=names, reference_speeds=unknown, reference_lengths=unknown, density=math.nan
    )
    coordinates = trajectory.coordinates
    modes = None if coordinates is None else coordinates.shape[1]
    with TrajectoryWriter.create(
        path,
        record,
        modes=modes,
        made_by={},
        overwrite=overwrite,
        forces=forces if names else None,
        averaged=forces if trajectory.mean_forces else None,
    ) as writer:
        for number, step in enumerate(steps):
            writer.append(int(step), float(time[number]), trajectory.snapshot(number))
        writer.finish(metadata)
    return Path(path)
