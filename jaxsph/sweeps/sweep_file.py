"""The one HDF5 file of a sweep, to which results are written member by member.

All room is taken when the file is made, and after that nothing but raw values is written: a
member's fields first and its status last. So the file is whole whenever its process is killed.
"""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np
from jaxtyping import Int

from ..environment import versions
from ..io import check_target
from ..scenes import Scene
from ..trajectory import Snapshot, Trajectory

FORMAT = "jaxsph sweep"
SCHEMA_VERSION = 1
NOT_RUN = -1
_UNITS = {"position": "m", "velocity": "m/s", "density": "kg/m^3", "pressure": "Pa"}


class SweepFileError(ValueError):
    """A sweep's file that cannot be read or written; one line says why and what to do."""


class Status(NamedTuple):
    """How each member went.

    Args:
        code: 0: to its end; a `FaultCode` where it met a fault; -1: not run yet (K,).
        step: that met the fault, else -1 (K,).
        particle: at which it shows, else -1 (K,).
        snapshots: that are good (K,).
        parameters: of each member's scene.
    """

    code: Int[np.ndarray, " members"]
    step: Int[np.ndarray, " members"]
    particle: Int[np.ndarray, " members"]
    snapshots: Int[np.ndarray, " members"]
    parameters: list[dict[str, Any]]


def create(path: str | os.PathLike, scenes: Sequence[Scene]) -> None:
    """A file with room for every member of a sweep; one that is there stays if it is of the same.

    Raises:
        SweepFileError: if the file is another sweep's, or cannot be made.
    """
    path = Path(path)
    first, identity = scenes[0], _identity(scenes)
    if path.exists():
        with _opened(path) as file:
            if file.attrs["identity"] != identity:
                raise SweepFileError(
                    f"{path}: holds another sweep; name another file, or repeat the scenes it was "
                    "made with to go on with it."
                )
        return
    check_target(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    state = first.state
    times = 1 + first.steps // first.steps_per_snapshot
    shapes = {"position": state.position.shape, "velocity": state.velocity.shape}
    shapes |= {"density": state.density.shape, "pressure": state.density.shape}
    unfinished = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        with h5py.File(unfinished, "w") as file:
            file.attrs["format"], file.attrs["schema_version"] = FORMAT, SCHEMA_VERSION
            file.attrs["units"], file.attrs["versions"] = "SI", json.dumps(versions())
            file.attrs["identity"] = identity
            file.attrs["time_step"] = first.time_step
            steps = np.arange(times) * first.steps_per_snapshot
            file["time"] = steps * first.time_step
            file["time"].attrs["unit"] = "s"
            for name, shape in shapes.items():
                early = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
                early.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
                early.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
                whole = (len(scenes), times, *shape)
                data = file.create_dataset(name, whole, np.dtype(state.density.dtype), dcpl=early)
                data.attrs["unit"] = _UNITS[name]
            for name in ("code", "step", "particle", "snapshots"):
                file[name] = np.full(len(scenes), NOT_RUN if name != "snapshots" else 0, np.int32)
        os.replace(unfinished, path)
    except OSError as error:
        raise SweepFileError(
            f"{path}: cannot be written ({error}); choose another place."
        ) from None
    finally:
        unfinished.unlink(missing_ok=True)


def store(path: str | os.PathLike, number: int, snapshots: Snapshot, status: Sequence[int]) -> None:
    """A member's snapshots (S, ...) and its (code, step, particle, good snapshots)."""
    with h5py.File(path, "r+") as file:
        for name in _UNITS:
            file[name][number] = getattr(snapshots, name)
        file.flush()
        code, *rest = status
        for name, value in zip(("step", "particle", "snapshots"), rest, strict=True):
            file[name][number] = value
        file.flush()
        file["code"][number] = code


def read_status(path: str | os.PathLike) -> Status:
    """How each member of a sweep went, and the parameters it was run with.

    Raises:
        SweepFileError: if the file is not a sweep's.
    """
    with _opened(Path(path)) as file:
        columns = (file[name][...] for name in Status._fields[:-1])
        return Status(*columns, json.loads(file.attrs["identity"])["parameters"])


def read_member(path: str | os.PathLike, number: int) -> Trajectory:
    """The good snapshots of a member.

    Raises:
        SweepFileError: if the file is not a sweep's, or the member has not been run.
    """
    with _opened(Path(path)) as file:
        count = len(file["code"])
        if not 0 <= number < count:
            raise SweepFileError(f"{path}: has members 0 to {count - 1}, not {number}.")
        code, good = int(file["code"][number]), int(file["snapshots"][number])
        if code == NOT_RUN:
            raise SweepFileError(f"{path}: member {number} has not been run yet; go on with it.")
        record = json.loads(file.attrs["identity"])
        return Trajectory(
            time=file["time"][:good],
            **{name: file[name][number, :good] for name in _UNITS},
            metadata={
                "scene": record["scene"],
                "parameters": record["parameters"][number],
                "time_step": float(file.attrs["time_step"]),
                "code": code,
                "step": int(file["step"][number]),
            },
        )


def _identity(scenes: Sequence[Scene]) -> str:
    """What tells a sweep from others."""
    return json.dumps(
        {"scene": scenes[0].name, "parameters": [dict(scene.parameters) for scene in scenes]}
    )


def _opened(path: Path) -> h5py.File:
    try:
        file = h5py.File(path, "r")
    except OSError as error:
        raise SweepFileError(f"{path}: cannot be read ({error}); check its name.") from None
    if file.attrs.get("format") != FORMAT or int(file.attrs["schema_version"]) > SCHEMA_VERSION:
        file.close()
        raise SweepFileError(f"{path}: is no sweep that this version of jaxsph reads.")
    return file
