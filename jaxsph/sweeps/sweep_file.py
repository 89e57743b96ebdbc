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

from ..content import content, differences
from ..environment import versions
from ..io import ForceHistory, TrajectoryFileError, unwritable, whole_file
from ..io.recorded_forces import kept_kind, link_time, parts, scale_of
from ..io.trajectory_file import BODIES, FIELDS, read_more, rows_of, unit_of
from ..record import plain
from ..scenes import Scene
from ..trajectory import Snapshot, Trajectory
from ..wall_forces import WallForces, named

FORMAT = "jaxsph sweep"
SCHEMA_VERSION = 1
NOT_RUN = -1


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
    contents = _contents(scenes)
    if path.exists():
        _check(path, identity, contents)
        return
    times, forces = first.schedule.times, [WallForces.of(scene) for scene in scenes]
    try:
        with whole_file(path) as file:
            file.attrs["format"], file.attrs["schema_version"] = FORMAT, SCHEMA_VERSION
            file.attrs["units"], file.attrs["versions"] = "SI", json.dumps(versions())
            file.attrs["identity"] = identity
            file["content"] = [json.dumps(content) for content in contents]
            file.attrs["time_step"] = first.time_step
            file["time"] = times
            file["time"].attrs["unit"] = unit_of("time")
            for name, (shape, kind) in _room(first, forces[0]).items():
                early = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
                early.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
                early.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
                whole = (len(scenes), len(times), *shape)
                data = file.create_dataset(name, whole, np.dtype(kind), dcpl=early)
                data.attrs["unit"] = unit_of(name)
            for name in parts(file):
                file[f"references/{name}"] = _references(forces, forces[0].names.index(name))
            link_time(file)
            for name in ("code", "step", "particle", "snapshots"):
                file[name] = np.full(len(scenes), NOT_RUN if name != "snapshots" else 0, np.int32)
    except TrajectoryFileError as error:
        raise SweepFileError(str(error)) from None


def _room(scene: Scene, forces: WallForces | None) -> dict[str, tuple[tuple[int, ...], Any]]:
    """Shape and type of what each snapshot has, by the names of its datasets."""
    state = scene.state
    particles, dim = state.position.shape
    dtype = state.density.dtype
    room = {name: ((particles,), dtype) for name in FIELDS}
    room |= {name: ((particles, dim), dtype) for name in ("position", "velocity")}
    if scene.parking is not None:
        room["active"] = ((particles,), bool)
    for name in () if state.bodies is None else BODIES:
        like = getattr(state.bodies, name)
        room[f"bodies/{name}"] = (like.shape, like.dtype)
    for prefix, each in (("", forces), ("mean_", named(forces))):
        for name in () if each is None else each.names:
            room[f"{prefix}forces/{name}"] = ((dim,), dtype)
            room[f"{prefix}torques/{name}"] = (() if dim == 2 else (dim,), dtype)
    return room


def _references(forces: Sequence[WallForces], part: int) -> np.ndarray:
    """Speed [m/s], length [m] and density [kg/m^3] (K, 3) that each member's coefficients of a part
    refer to."""
    return np.array(
        [(f.reference_speeds[part], f.reference_lengths[part], f.density) for f in forces]
    )


def store(path: str | os.PathLike, number: int, snapshots: Snapshot, status: Sequence[int]) -> None:
    """A member's snapshots (S, ...) and its (code, step, particle, good snapshots).

    Raises:
        SweepFileError: if they cannot be written; the member then counts as not run.
    """
    code, *rest = status
    with _opened(Path(path)) as file:
        # one that was begun before forces were kept has no room for them
        rows = {name: value for name, value in rows_of(snapshots).items() if name in file}
        rows |= zip(("step", "particle", "snapshots", "code"), (*rest, code), strict=True)
        kinds = {name: file[name].dtype for name in rows}
        places = {name: file[name].id.get_offset() for name in rows}
    try:  # without HDF5, which does not survive a disk that fails
        with open(path, "r+b", buffering=0) as file:
            for name, value in rows.items():
                data = memoryview(np.ascontiguousarray(value, kinds[name]).reshape(-1)).cast("B")
                file.seek(places[name] + number * len(data))
                while data:
                    data = data[file.write(data) :]
    except OSError as error:
        raise SweepFileError(str(unwritable(Path(path), error))) from None


def read_status(path: str | os.PathLike) -> Status:
    """How each member of a sweep went, and the parameters it was run with.

    Raises:
        SweepFileError: if the file is not a sweep's.
    """
    with _opened(Path(path)) as file:
        columns = (file[name][...] for name in Status._fields[:-1])
        return Status(*columns, json.loads(file.attrs["identity"])["parameters"])


def read_member(path: str | os.PathLike, number: int) -> Trajectory:
    """The good snapshots of a member, with the forces on its walls and its free bodies.

    Raises:
        SweepFileError: if the file is not a sweep's, or the member has not been run.
    """
    with _opened(Path(path)) as file:
        code, good = _of_member(file, path, number)
        rows = (number, slice(good))
        record = json.loads(file.attrs["identity"])
        return Trajectory(
            time=file["time"][:good],
            **{name: file[name][rows] for name in FIELDS},
            **read_more(file, rows),
            metadata={
                "scene": record["scene"],
                "parameters": record["parameters"][number],
                "time_step": float(file.attrs["time_step"]),
                "code": code,
                "step": int(file["step"][number]),
            },
        )


def read_member_forces(path: str | os.PathLike, number: int) -> dict[str, ForceHistory]:
    """The forces on the walls of a member, `walls` and each named part.

    Raises:
        SweepFileError: if the file is not a sweep's, or the member has not been run.
    """
    found = {}
    with _opened(Path(path)) as file:
        _, good = _of_member(file, path, number)
        for name in parts(file):
            kind = kept_kind(file, "forces", name)
            force = file[f"{kind}/{name}"][number, :good]
            scale = scale_of(*map(float, file[f"references/{name}"][number]), force.shape[1])
            found[name] = ForceHistory(file["time"][:good], force, kind != "forces", scale)
    return found


def _of_member(file: h5py.File, path: str | os.PathLike, number: int) -> tuple[int, int]:
    """Code and number of good snapshots of a member.

    Raises:
        SweepFileError: if there is none, or it has not been run.
    """
    count = len(file["code"])
    if not 0 <= number < count:
        raise SweepFileError(f"{path}: has members 0 to {count - 1}, not {number}.")
    code, good = int(file["code"][number]), int(file["snapshots"][number])
    if code == NOT_RUN:
        raise SweepFileError(f"{path}: member {number} has not been run yet; go on with it.")
    return code, good


def _identity(scenes: Sequence[Scene]) -> str:
    """What tells a sweep from others."""
    parameters = plain([scene.parameters for scene in scenes], "parameters")
    return json.dumps({"scene": scenes[0].name, "parameters": parameters})


def _contents(scenes: Sequence[Scene]) -> list[dict[str, str]]:
    """What the first scene holds, and what each other one holds otherwise."""
    first, *others = map(content, scenes)
    return [first, *({k: v for k, v in c.items() if first.get(k) != v} for c in others)]


def _check(path: Path, identity: str, contents: Sequence[dict[str, str]]) -> None:
    """A SweepFileError that says in what the sweep in a file is another one."""
    with _opened(path) as file:
        kept = [json.loads(text) for text in file["content"].asstr()] if "content" in file else []
        other = ""
        if not kept or len(kept) != len(contents):
            other = f"{len(file['code'])} members"
            other += "" if kept else ", and what they were is not in it"
        elif file.attrs["identity"] != identity or kept != contents:
            pairs = zip(kept, contents, strict=True)
            told = (
                (k, differences({**kept[0], **a}, {**contents[0], **b}))
                for k, (a, b) in enumerate(pairs)
            )
            other = next((f"member {k}: {text}" for k, text in told if text), "other parameters")
    if other:
        raise SweepFileError(
            f"{path}: holds another sweep ({other}); name another file, or repeat the scenes it "
            "was made with to go on with it."
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
