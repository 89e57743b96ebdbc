"""What a trajectory file tells of its run, read without its fields; and single snapshots."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..schedule import Schedule
from ..trajectory import Snapshot
from .body_shapes import told_bodies
from .recorded_forces import told
from .trajectory_file import (
    FIELDS,
    TrajectoryFileError,
    opened,
    patient,
    read_more,
    schedule_of,
)


@dataclass(frozen=True)
class Overview:
    """A run as its file tells of it, whether it has ended or not.

    Args:
        scene, parameters: name and record of the scene.
        effects: what acts on the particles; empty if that is not recorded.
        mass: of a particle [kg]; None if that is not recorded.
        versions: of the software that wrote the file, by name.
        metadata: of the trajectory; with run times once it is complete.
        schedule: of the whole run.
        complete: whether the run has ended.
        snapshots: how many are stored.
        step, time: of the last one; -1 and 0 s if there is none.
        particles, dim: how many, and in how many dimensions.
        dtype: of the fields.
        size: of the file [bytes].
        forces: on each part of the walls, by name: force [N] and torque [N m] of the last snapshot
            and in the mean over the last fifth of what is there, drag and lift coefficients of that
            mean, and what they refer to.
        bodies: of each free body its last state, and the lowest and highest place of its centre.
    """

    scene: str
    parameters: dict[str, Any]
    effects: tuple[str, ...]
    mass: float | None
    versions: dict[str, str]
    metadata: dict[str, Any]
    schedule: Schedule
    complete: bool
    snapshots: int
    step: int
    time: float
    particles: int
    dim: int
    dtype: str
    size: int
    forces: dict[str, dict[str, Any]]
    bodies: tuple[dict[str, Any], ...] = ()


@patient
def read_overview(path: str | os.PathLike) -> Overview:
    """What a file tells of its run; it may still be written.

    Raises:
        TrajectoryFileError: if the file is not a whole trajectory file.
    """
    path = Path(path)
    with opened(path) as (file, count):
        attributes = file.attrs
        return Overview(
            scene=str(attributes["scene"]),
            parameters=json.loads(attributes["parameters"]),
            effects=tuple(json.loads(attributes.get("effects", "[]"))),
            mass=float(attributes["mass"]) if "mass" in attributes else None,
            versions=json.loads(attributes.get("versions", "{}")),
            metadata=json.loads(attributes["metadata"]),
            schedule=schedule_of(file),
            complete=bool(attributes["complete"]),
            snapshots=count,
            step=int(file["step"][count - 1]) if count else -1,
            time=float(file["time"][count - 1]) if count else 0.0,
            particles=file["position"].shape[1],
            dim=file["position"].shape[2],
            dtype=str(file["position"].dtype),
            size=path.stat().st_size,
            forces=told(file, count),
            bodies=told_bodies(file, count),
        )


@patient
def read_snapshot(path: str | os.PathLike, number: int = -1) -> tuple[float, Snapshot]:
    """Time [s] and fields of one snapshot; -1 for the last.

    Raises:
        TrajectoryFileError: if the file is not a whole trajectory file with that snapshot in it.
    """
    with opened(Path(path)) as (file, count):
        if count == 0:
            raise TrajectoryFileError(f"{path}: holds no snapshot yet; run its scene anew.")
        if not -count <= number < count:
            raise TrajectoryFileError(
                f"{path}: holds no snapshot of number {number}; it has {count} of them, from 0 on."
            )
        number %= count
        coordinates = file["coordinates"][number] if "coordinates" in file else None
        fields = (file[name][number] for name in FIELDS)
        more = read_more(file, number)
        return float(file["time"][number]), Snapshot(*fields, coordinates=coordinates, **more)
