"""Writing trajectories to HDF5 files that a killed run leaves readable.

A file grows in HDF5's single-writer-multiple-readers mode: what has been flushed stays readable
whenever the process ends. Fields go in first and the step's number last, so that the number of
steps says how many snapshots are whole.
"""

from __future__ import annotations

import dataclasses
import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from ..content import content
from ..environment import versions
from ..record import plain
from ..trajectory import Snapshot
from ..wall_forces import WallForces
from .body_shapes import begin_shapes
from .growing_file import COMPRESSION, abandon, add_dataset, begin, check_target, unwritable
from .lock import Lock
from .recorded_forces import begin_forces, link_time, sum_up
from .trajectory_file import (
    BODIES,
    FORMAT,
    LOADS,
    SCHEMA_VERSION,
    UNITS,
    TrajectoryFileError,
    count_up_to,
    growing,
    opened,
    rows_of,
)

_ORIGIN = ("scene", "parameters")  # metadata that hold for a part of a run too
_METADATA_SPACE = 16384  # bytes; the attribute keeps the size it has at the start


class TrajectoryWriter:
    """A trajectory file being written: a `Recorder` for `simulate`, and a context manager.

    Make one by `create`, `append_to` or `branch`. `last_step` is the last step stored, -1 if there
    is none. Until it is closed no other writer may have the file.

    Examples:
        >>> import jaxsph
        >>> from jaxsph.arrangements import Lattice
        >>> from jaxsph.io import TrajectoryWriter, read_trajectory
        >>> scene = jaxsph.scenes.taylor_green(16, end_time=0.06, arrangement=Lattice())
        >>> with TrajectoryWriter.create("trajectory.h5", scene) as writer:
        ...     trajectory = jaxsph.run_scene(scene, recorder=writer)
        ...     writer.finish(trajectory.metadata)
        >>> read_trajectory("trajectory.h5").particles
        256
    """

    def __init__(self, path: Path, fill: Callable[[h5py.File], None]):
        self.path, self._lock = path, Lock(path)
        try:
            self._file = file = begin(path, fill)
        except BaseException:
            self._lock.release()
            raise
        self._count = len(file["step"])
        self.last_step = int(file["step"][-1]) if self._count else -1
        self.last_time = float(file["time"][-1]) if self._count else None

    @classmethod
    def create(
        cls,
        path: str | os.PathLike,
        scene: Any,
        *,
        modes: int | None = None,
        metadata: dict | None = None,
        made_by: Mapping[str, str] | None = None,
        overwrite: bool = False,
        forces: WallForces | None = None,
        averaged: WallForces | None = None,
    ) -> TrajectoryWriter:
        """A new file for a run of a scene; folders are made as needed.

        Args:
            path: of the file.
            scene: gives name, parameters, schedule, effects, the mass of a particle [kg] (None
                where they have none), and the particles' number and precision.
            modes: number of reduced coordinates that snapshots carry, if any.
            metadata: kept with the trajectory, JSON-like.
            made_by: the `content` of what makes the run; that of the scene if none is given.
            overwrite: whether an existing file may be replaced.
            forces: on the walls, if snapshots carry those that this measures.
            averaged: the same, if snapshots carry their means.

        Raises:
            TrajectoryFileError: if the file exists, cannot be made, or is being written.
        """
        path = Path(path)
        check_target(path, overwrite)
        state = scene.state
        made_by = content(scene) if made_by is None else made_by
        shapes = {name: getattr(state, name).shape for name in ("position", "velocity", "density")}
        shapes["pressure"] = shapes["density"]
        if modes is not None:
            shapes["coordinates"] = (modes,)
        metadata = {"scene": scene.name, "parameters": scene.parameters, **(metadata or {})}

        def fill(file):
            file.attrs["format"] = FORMAT
            file.attrs["schema_version"] = SCHEMA_VERSION
            file.attrs["units"] = "SI"
            file.attrs["versions"] = json.dumps(versions())
            file.attrs["scene"] = scene.name
            file.attrs["parameters"] = _to_json(scene.parameters)
            file.attrs["content"] = json.dumps(dict(made_by))
            schedule = scene.schedule
            file.attrs["time_step"] = float(schedule.time_step)
            file.attrs["steps"] = int(schedule.steps)
            file.attrs["steps_per_snapshot"] = int(schedule.steps_per_snapshot)
            file.attrs["complete"] = False
            file.attrs["effects"] = json.dumps([effect.name for effect in scene.effects])
            if scene.mass is not None:
                file.attrs["mass"] = float(scene.mass)
            text = _to_json(metadata)
            room = max(_METADATA_SPACE, 2 * len(text))
            file.attrs.create("metadata", np.bytes_(text), dtype=f"S{room}")
            if getattr(scene, "parking", None) is not None:
                add_dataset(file, "active", shapes["density"], np.dtype(bool), **COMPRESSION)
            for name, shape in shapes.items():
                add_dataset(file, name, shape, np.dtype(state.position.dtype), **COMPRESSION)
            add_dataset(file, "time", (), np.dtype("float64"), fillvalue=np.nan)
            add_dataset(file, "step", (), np.dtype("int64"), fillvalue=-1)
            space = getattr(scene, "space", None)
            if space is not None:
                file.attrs["box"] = json.dumps(dataclasses.asdict(space.box))
            walls = getattr(scene, "walls", None)
            if walls is not None:
                file.create_group("walls")["position"] = np.float32(walls.fixed_position)
                begin_shapes(file, walls)
            for name in () if state.bodies is None else BODIES:
                like = np.asarray(getattr(state.bodies, name))
                add_dataset(file, f"bodies/{name}", like.shape, like.dtype)
            loads = ("", forces), ("mean_", averaged)
            for prefix, each in (pair for pair in loads if pair[1] is not None):
                dim, dtype = shapes["position"][1], np.dtype(state.position.dtype)
                begin_forces(file, each, dim, dtype, prefix)

        return cls(path, fill)

    @classmethod
    def append_to(cls, path: str | os.PathLike, scene: Any = None) -> TrajectoryWriter:
        """Go on with a file whose run was cut short, from its last whole snapshot.

        The snapshots go into a copy, which then takes the file's place: there is a whole file at
        any time.

        Args:
            path: of the file.
            scene: that the run goes on as, its end another one say; as it was if none is given.

        Raises:
            TrajectoryFileError: if the file cannot be read or written.
        """
        path = Path(path)
        check_target(path, overwrite=True)

        def fill(file):
            with opened(path) as (source, count):
                _copy_attributes(source, file, scene)
                for name in source:
                    source.copy(name, file)
                for name in growing(source):
                    file[name].resize(count, 0)
                link_time(file)

        return cls(path, fill)

    @classmethod
    def branch(
        cls, source: str | os.PathLike, path: str | os.PathLike, step: int, scene: Any = None
    ) -> TrajectoryWriter:
        """A new file that goes on from a snapshot of another one, which stays as it is.

        It begins with that one's snapshots up to this; later ones are not copied.

        Args:
            source: of the other file.
            path: of the new one; folders are made as needed.
            step: of the snapshot to go on from.
            scene: as for `append_to`.

        Raises:
            TrajectoryFileError: if the source has no snapshot of that step or cannot be read, or
                if the new file exists or cannot be made.
        """
        path = Path(path)
        check_target(path, overwrite=False)
        with opened(Path(source)) as (old, stored):
            count = count_up_to(source, old["step"][:stored], step)

            def fill(file):
                _copy_attributes(old, file, scene)
                metadata = {name: json.loads(old.attrs["metadata"]).get(name) for name in _ORIGIN}
                file.attrs.modify("metadata", np.bytes_(_to_json(metadata)))
                rows = growing(old)
                for name in old:
                    if name not in (*UNITS, *LOADS, "bodies"):
                        old.copy(name, file)
                for name in rows:
                    like = old[name]
                    made = add_dataset(
                        file, name, like.shape[1:], like.dtype, fillvalue=like.fillvalue,
                        **(COMPRESSION if like.compression else {}),
                    )  # fmt: skip
                    for key, value in like.attrs.items():
                        made.attrs[key] = value
                    made.resize(count, 0)
                    for k in range(count):
                        made[k] = like[k]
                link_time(file)

            return cls(path, fill)

    def append(self, step: int, time: float, snapshot: Snapshot) -> None:
        """Store a snapshot; it is safe once this returns. The last one again is left out.

        Raises:
            TrajectoryFileError: if the disk takes no more; what was stored before stays readable.
        """
        if step == self.last_step:
            return
        rows = {**rows_of(snapshot), "time": time, "step": step}  # the step last
        self._tried(lambda: self._store(rows))
        self._count, self.last_step, self.last_time = self._count + 1, step, time

    def _store(self, fields: dict[str, Any]) -> None:
        for name, value in fields.items():
            if name in self._file:
                dataset = self._file[name]
                dataset.resize(self._count + 1, 0)
                dataset[self._count] = np.asarray(value)
                dataset.flush()

    def finish(self, metadata: dict | None = None) -> None:
        """Mark the run complete, with the metadata of its trajectory.

        Raises:
            TrajectoryFileError: if the metadata do not fit into the room left for them, or the
                disk takes no more.
        """
        attributes = self._file.attrs
        if metadata is not None:
            text = np.bytes_(_to_json(metadata))
            room = attributes.get_id("metadata").dtype.itemsize
            if len(text) > room:
                raise TrajectoryFileError(
                    f"metadata: {len(text)} bytes do not fit into {self.path}, which has room for "
                    f"{room}; keep large results elsewhere."
                )
            self._tried(lambda: attributes.modify("metadata", text))
        self._tried(lambda: sum_up(self._file, self._count))
        self._tried(lambda: attributes.modify("complete", True))
        self._tried(self._file.flush)

    def close(self) -> None:
        """Close the file and let others write it; nothing happens if it is closed.

        Raises:
            TrajectoryFileError: if the disk takes no more; what was stored stays readable.
        """
        try:
            self._tried(self._file.close)
        finally:
            self._lock.release()

    def _tried(self, action: Callable[[], None]) -> None:
        try:
            action()
        except (OSError, RuntimeError) as error:
            abandon(self._file)
            raise unwritable(self.path, error) from None

    def __enter__(self) -> TrajectoryWriter:
        return self

    def __exit__(self, *exception) -> None:
        self.close()


def _copy_attributes(source: h5py.File, file: h5py.File, scene: Any) -> None:
    """What a file says of its run, which is not complete; of the scene, if another is given."""
    for name, value in source.attrs.items():
        file.attrs.create(name, value, dtype=source.attrs.get_id(name).dtype)
    file.attrs["complete"] = False
    if scene is not None:
        file.attrs["steps"] = int(scene.steps)
        file.attrs["parameters"] = _to_json(scene.parameters)
        if "content" in source.attrs:  # its particles are no longer those of the start
            kept = json.loads(source.attrs["content"])
            start = {name: text for name, text in kept.items() if name.startswith("state.")}
            file.attrs["content"] = json.dumps({**content(scene), **start})


def _to_json(value: Any) -> str:
    return json.dumps(plain(value, "parameters"))
