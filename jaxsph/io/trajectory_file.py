"""Reading trajectories from HDF5 files: their layout, and what can be wrong with one."""

from __future__ import annotations

import functools
import json
import os
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from ..body_state import BodyState
from ..content import differences
from ..domain import Box
from ..particles import ParticleState
from ..schedule import Schedule
from ..trajectory import Snapshot, Trajectory
from .unclosed_file import open_to_read

FORMAT = "jaxsph trajectory"
SCHEMA_VERSION = 1
UNITS = {
    "position": "m",
    "velocity": "m/s",
    "density": "kg/m^3",
    "pressure": "Pa",
    "coordinates": "1",
    "active": "1",
    "time": "s",
    "step": "1",
}
# groups of a dataset for each part of the walls
LOADS = {"forces": "N", "torques": "N m", "mean_forces": "N", "mean_torques": "N m"}
# datasets of the group `bodies`, a row for each free body
BODIES = {"position": "m", "angle": "rad", "velocity": "m/s", "spin": "rad/s"}
FIELDS = ("position", "velocity", "density", "pressure")
_ATTRIBUTES = ("scene", "parameters", "metadata", "time_step", "steps", "steps_per_snapshot")
Rows = int | slice | tuple[int, slice]  # of a snapshot, of some, or of a sweep's member
_SIGNATURE = b"\x89HDF\r\n\x1a\n"


class TrajectoryFileError(ValueError):
    """A trajectory file that cannot be read or written; one line says why and what to do."""


@dataclass(frozen=True)
class Checkpoint:
    """How far a trajectory file has come, and what it takes to go on.

    Args:
        scene, parameters: name and record of the scene.
        schedule: of the whole run.
        complete: whether the run has ended.
        step: number of the last stored step, or of the one asked for; -1 if there is none.
        state: the particles at that step.
        content: of the scene and of what else made the run; None in files from before it was kept.
    """

    scene: str
    parameters: dict[str, Any]
    schedule: Schedule
    complete: bool
    step: int
    state: ParticleState | None
    content: dict[str, str] | None = None

    def check(self, path: str | os.PathLike, wanted: Mapping[str, str]) -> None:
        """Make sure that the run in a file is the one that is wanted.

        Raises:
            TrajectoryFileError: naming what differs.
        """
        if self.content is None:
            raise TrajectoryFileError(
                f"{path}: was written by a version of jaxsph that did not keep what was run, so it "
                "may be another run; remove it, or name another folder."
            )
        other = differences(self.content, wanted)
        if other:
            raise TrajectoryFileError(
                f"{path}: holds another run ({other}); name another folder, or remove it."
            )


class _Damaged(TrajectoryFileError):
    """What is there cannot be made out."""


def patient(read):
    """A file that grows can look damaged for a moment; read it a few times before giving up."""

    @functools.wraps(read)
    def attempt(path, *arguments):
        for pause in (0.02, 0.05, 0.1):  # s
            try:
                return read(path, *arguments)
            except _Damaged:
                time.sleep(pause)
        return read(path, *arguments)

    return attempt


@patient
def read_trajectory(path: str | os.PathLike) -> Trajectory:
    """The trajectory in a file, as far as its run has come, with the metadata it was run with.

    Raises:
        TrajectoryFileError: if the file is not a whole trajectory file with a snapshot in it.
    """
    with opened(Path(path)) as (file, count):
        if count == 0:
            raise TrajectoryFileError(f"{path}: holds no snapshot yet; run its scene anew.")
        metadata = json.loads(_text(file.attrs["metadata"]))
        if not file.attrs["complete"]:
            metadata.setdefault("time_step", float(file.attrs["time_step"]))
            metadata["steps"] = int(file["step"][count - 1])
        fields = {name: file[name][:count] for name in ("time", *FIELDS)}
        coordinates = file["coordinates"][:count] if "coordinates" in file else None
        return Trajectory(
            **fields, coordinates=coordinates, metadata=metadata, **read_more(file, slice(count))
        )


def read_walls(path: str | os.PathLike) -> np.ndarray | None:
    """Where the walls of a run have their ghosts (G, n) [m], but those of bodies that are moved;
    None where there are none, or none are known.

    Raises:
        TrajectoryFileError: if the file is not a whole trajectory file.
    """
    with opened(Path(path)) as (file, _):
        return file["walls/position"][:] if "walls/position" in file else None


@patient
def read_box(path: str | os.PathLike) -> Box | None:
    """The box of a run; None where it is not known, as of points of a reduced model.

    Raises:
        TrajectoryFileError: if the file is not a whole trajectory file.
    """
    with opened(Path(path)) as (file, _):
        if "box" not in file.attrs:
            return None
        told = json.loads(file.attrs["box"])
    return Box(*(tuple(told[name]) for name in ("lower", "upper", "periodic")))


@patient
def read_checkpoint(path: str | os.PathLike, step: int | None = None) -> Checkpoint:
    """What a file says of its run, and the particles of a snapshot.

    Args:
        path: of the file.
        step: of the snapshot; the last one if none is given.

    Raises:
        TrajectoryFileError: if the file is not a whole trajectory file, or has no snapshot of that
            step.
    """
    with opened(Path(path)) as (file, count):
        state = None
        if step is not None:
            count = count_up_to(path, file["step"][:count], step)
        if count:
            position, velocity, density, _ = (file[name][count - 1] for name in FIELDS)
            state = ParticleState(position, velocity, density, read_bodies(file, count - 1))
        return Checkpoint(
            scene=_text(file.attrs["scene"]),
            parameters=json.loads(_text(file.attrs["parameters"])),
            schedule=schedule_of(file),
            complete=bool(file.attrs["complete"]),
            step=int(file["step"][count - 1]) if count else -1,
            state=state,
            content=json.loads(_text(file.attrs["content"])) if "content" in file.attrs else None,
        )


def rows_of(snapshot: Snapshot) -> dict[str, Any]:
    """What a snapshot has, by the names of its datasets."""
    found = {name: getattr(snapshot, name, None) for name in UNITS}
    for kind in LOADS:
        found |= {f"{kind}/{name}": value for name, value in getattr(snapshot, kind).items()}
    for name in () if snapshot.bodies is None else BODIES:
        found[f"bodies/{name}"] = getattr(snapshot.bodies, name)
    return {name: value for name, value in found.items() if value is not None}


def unit_of(name: str) -> str:
    """The unit of a dataset, by its name."""
    kind, _, part = name.partition("/")
    return BODIES[part] if kind == "bodies" else (UNITS | LOADS)[kind]


def growing(file: h5py.File) -> list[str]:
    """The datasets that have a row for each snapshot."""
    fields = [name for name in UNITS if name in file]
    loads = [f"{kind}/{name}" for kind in LOADS if kind in file for name in file[kind]]
    loads += [f"bodies/{name}" for name in BODIES if "bodies" in file]
    return fields + [name for name in loads if name != "forces/time"]  # the time itself, linked


def read_loads(file: h5py.File, rows: Rows) -> dict[str, dict[str, np.ndarray]]:
    """Forces and torques of some snapshots, by the names of the walls' parts."""
    found: dict[str, dict[str, np.ndarray]] = {kind: {} for kind in LOADS}
    for path in growing(file):
        kind, _, name = path.partition("/")
        if name and kind in LOADS:
            found[kind][name] = file[path][rows]
    return found


def read_bodies(file: h5py.File, rows: Rows) -> BodyState | None:
    """The free bodies of some snapshots; None where there are none."""
    if "bodies" not in file:
        return None
    return BodyState(**{name: file[f"bodies/{name}"][rows] for name in BODIES})


def read_more(file: h5py.File, rows: Rows) -> dict[str, Any]:
    """What some snapshots have beside their fields: forces, free bodies, who is in the flow."""
    active = file["active"][rows] if "active" in file else None
    return {**read_loads(file, rows), "bodies": read_bodies(file, rows), "active": active}


def schedule_of(file: h5py.File) -> Schedule:
    """The steps of the run in a file."""
    each = int(file.attrs["steps_per_snapshot"])
    return Schedule(float(file.attrs["time_step"]), each, int(file.attrs["steps"]) // each)


def count_up_to(path: str | os.PathLike, stored: np.ndarray, step: int) -> int:
    """The number of snapshots up to that of a step."""
    found = np.flatnonzero(stored == step)
    if len(found):
        return int(found[0]) + 1
    there = "none at all"
    if len(stored):
        there = f"those of steps {', '.join(map(str, stored[:3]))}"
        there += f", ... to {stored[-1]}" if len(stored) > 3 else ""
    raise TrajectoryFileError(f"{path}: holds no snapshot of step {step}; it has {there}.")


@contextmanager
def opened(path: Path) -> Iterator[tuple[h5py.File, int]]:
    """A trajectory file open to read, checked, and the number of whole snapshots in it."""
    try:
        with open(path, "rb") as file:
            signature = file.read(len(_SIGNATURE))
    except FileNotFoundError:
        raise TrajectoryFileError(
            f"{path}: there is no such file; check its name and folder."
        ) from None
    except OSError as error:
        raise TrajectoryFileError(f"{path}: cannot be read ({error.strerror}).") from None
    if signature != _SIGNATURE:
        raise TrajectoryFileError(
            f"{path}: is not an HDF5 file; give the trajectory.h5 of a run, or run the scene anew."
        )
    damaged = _Damaged(
        f"{path}: is truncated or damaged and cannot be read; restore a copy or run the scene anew."
    )
    try:
        file = open_to_read(path)
    except OSError:
        raise damaged from None
    with file:
        try:
            _check_schema(path, file)
            lengths = {len(file[name]) for name in growing(file)}
            if file.attrs["complete"] and len(lengths) > 1:
                raise damaged
            steps = file["step"][: min(lengths)]
            yield file, int(np.argmax(np.append(steps, -1) < 0))  # -1: grown but not yet filled
        except TrajectoryFileError:
            raise
        except (OSError, RuntimeError, KeyError, ValueError, TypeError, AttributeError):
            raise damaged from None


def _check_schema(path: Path, file: h5py.File) -> None:
    attributes = file.attrs
    if _text(attributes.get("format", "")) != FORMAT:
        raise TrajectoryFileError(
            f"{path}: is HDF5 but not a jaxsph trajectory; give the trajectory.h5 of a run."
        )
    version = int(attributes.get("schema_version", 0))
    if version != SCHEMA_VERSION:
        raise TrajectoryFileError(
            f"{path}: has schema version {version}, this jaxsph reads {SCHEMA_VERSION}; "
            "use the version of jaxsph that wrote it, or a newer one."
        )
    missing = [f"dataset {name!r}" for name in ("time", "step", *FIELDS) if name not in file]
    missing += [f"attribute {n!r}" for n in (*_ATTRIBUTES, "complete") if n not in attributes]
    if missing:
        raise TrajectoryFileError(
            f"{path}: lacks {', '.join(missing)}; restore a copy or run the scene anew."
        )
    particles = {file[name].shape[1:2] for name in FIELDS}
    if len(particles) != 1 or file["position"].shape[1:] != file["velocity"].shape[1:]:
        raise TrajectoryFileError(
            f"{path}: its datasets disagree on the number of particles; restore a copy or run the "
            "scene anew."
        )


def _text(value: Any) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)
