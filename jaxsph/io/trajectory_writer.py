"""Writing trajectories to HDF5 files that a killed run leaves readable.

A file grows in HDF5's single-writer-multiple-readers mode: what has been flushed stays readable
whenever the process ends. Fields go in first and the step's number last, so that the number of
steps says how many snapshots are whole.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import tempfile
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from ..environment import versions
from ..trajectory import Snapshot
from .trajectory_file import (
    FORMAT,
    SCHEMA_VERSION,
    UNITS,
    TrajectoryFileError,
    opened,
)

# gzip takes a third longer to write than lzf (6 against 4.5 ms a snapshot of 4096 particles) and
# saves a sixth instead of a tenth; any HDF5 reads it.
_COMPRESSION = {"compression": "gzip", "compression_opts": 1, "shuffle": True}
_OPENING = {"libver": "v110", "locking": "best-effort"}  # v110: the oldest that can grow this way
_METADATA_SPACE = 16384  # bytes; the attribute keeps the size it has at the start


class TrajectoryWriter:
    """A trajectory file being written: a `Recorder` for `simulate`, and a context manager.

    Make one by `create` or `append_to`. `last_step` is the last step stored, -1 if there is none.

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

    def __init__(self, path: Path, file: h5py.File):
        self.path = path
        self._file = file
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
        overwrite: bool = False,
    ) -> TrajectoryWriter:
        """A new file for a run of a scene; folders are made as needed.

        Args:
            path: of the file.
            scene: gives name, parameters, steps, and the particles' number and precision.
            modes: number of reduced coordinates that snapshots carry, if any.
            metadata: kept with the trajectory, JSON-like.
            overwrite: whether an existing file may be replaced.

        Raises:
            TrajectoryFileError: if the file exists or cannot be made.
        """
        path = Path(path)
        check_target(path, overwrite)
        state = scene.state
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
            file.attrs["time_step"] = float(scene.time_step)
            file.attrs["steps"] = int(scene.steps)
            file.attrs["steps_per_snapshot"] = int(scene.steps_per_snapshot)
            file.attrs["complete"] = False
            text = _to_json(metadata)
            space = max(_METADATA_SPACE, 2 * len(text))
            file.attrs.create("metadata", np.bytes_(text), dtype=f"S{space}")
            for name, shape in shapes.items():
                _add_dataset(file, name, shape, np.dtype(state.position.dtype), **_COMPRESSION)
            _add_dataset(file, "time", (), np.dtype("float64"), fillvalue=np.nan)
            _add_dataset(file, "step", (), np.dtype("int64"), fillvalue=-1)

        return cls(path, _begin(path, fill))

    @classmethod
    def append_to(cls, path: str | os.PathLike) -> TrajectoryWriter:
        """Go on with a file whose run was cut short, from its last whole snapshot.

        The snapshots go into a copy, which then takes the file's place: there is a whole file at
        any time.

        Raises:
            TrajectoryFileError: if the file cannot be read or written.
        """
        path = Path(path)
        check_target(path, overwrite=True)
        with opened(path) as (source, count):

            def fill(file):
                for name, value in source.attrs.items():
                    file.attrs.create(name, value, dtype=source.attrs.get_id(name).dtype)
                file.attrs["complete"] = False
                for name in source:
                    source.copy(name, file)
                    file[name].resize(count, 0)

            return cls(path, _begin(path, fill))

    def append(self, step: int, time: float, snapshot: Snapshot) -> None:
        """Store a snapshot; it is safe once this returns. The last one again is left out.

        Raises:
            TrajectoryFileError: if the disk takes no more; what was stored before stays readable.
        """
        if step == self.last_step:
            return
        fields = {name: getattr(snapshot, name) for name in UNITS if hasattr(snapshot, name)}
        try:
            for name, value in {**fields, "time": time, "step": step}.items():
                if value is not None and name in self._file:
                    dataset = self._file[name]
                    dataset.resize(self._count + 1, 0)
                    dataset[self._count] = np.asarray(value)
                    dataset.flush()
        except (OSError, RuntimeError) as error:
            _abandon(self._file)
            raise _unwritable(self.path, error) from None
        self._count, self.last_step, self.last_time = self._count + 1, step, time

    def finish(self, metadata: dict | None = None) -> None:
        """Mark the run complete, with the metadata of its trajectory.

        Raises:
            TrajectoryFileError: if the metadata do not fit into the room left for them.
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
            attributes.modify("metadata", text)
        attributes.modify("complete", True)
        self._file.flush()

    def close(self) -> None:
        """Close the file; nothing happens if it is closed."""
        self._file.close()

    def __enter__(self) -> TrajectoryWriter:
        return self

    def __exit__(self, *exception) -> None:
        self.close()


def check_target(path: str | os.PathLike, overwrite: bool = True) -> None:
    """Make sure, leaving no trace, that a file can be written there.

    Raises:
        TrajectoryFileError: if it exists and may not be replaced, or its folder does not serve.
    """
    path = Path(path)
    try:
        if path.is_dir():
            raise TrajectoryFileError(f"{path}: is a folder; name a file.")
        if not overwrite and path.exists():
            raise TrajectoryFileError(
                f"{path}: exists already; choose another folder, replace it with overwrite "
                "(--overwrite) or go on with it (--resume)."
            )
        folder = path.parent
        while not folder.exists():
            folder = folder.parent
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise _unwritable(path, error) from None


def _begin(path: Path, fill) -> h5py.File:
    """A file that `fill` fills, put in its place once it can grow safely."""
    part = path.with_name(path.name + ".part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        file = h5py.File(part, "w", **_OPENING)
    except OSError as error:
        raise _unwritable(path, error) from None
    try:
        fill(file)
        file.swmr_mode = True
        os.replace(part, path)
    except BaseException as error:
        _abandon(file)
        part.unlink(missing_ok=True)
        if isinstance(error, (OSError, RuntimeError)):
            raise _unwritable(path, error) from None
        raise
    return file


def _abandon(file: h5py.File) -> None:
    """Close without writing: HDF5 never lets go of what it failed to write, so it goes nowhere."""
    nowhere = os.open(os.devnull, os.O_RDWR)
    os.dup2(nowhere, file.id.get_vfd_handle())
    os.close(nowhere)
    with contextlib.suppress(OSError, RuntimeError):
        file.close()


def _add_dataset(file, name, shape, dtype, **options) -> None:
    dataset = file.create_dataset(
        name,
        (0, *shape),
        dtype,
        maxshape=(None, *shape),
        chunks=(1, *shape) if shape else (256,),
        **options,
    )
    dataset.attrs["unit"] = UNITS[name]


def _to_json(value: Any) -> str:
    return json.dumps(value, default=lambda array: np.asarray(array).tolist())


def _unwritable(path: Path, error: Exception) -> TrajectoryFileError:
    quoted = re.search(r"error message = '([^']*)'", str(error))  # as HDF5 has it
    reason = quoted[1] if quoted else getattr(error, "strerror", None) or str(error)
    return TrajectoryFileError(
        f"{path}: cannot be written ({reason}); choose a folder that you may write to and that "
        "has room."
    )
