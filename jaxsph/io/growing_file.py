"""HDF5 files that grow while others read them: their making, their datasets, and failing disks."""

from __future__ import annotations

import contextlib
import os
import re
import tempfile
from collections.abc import Callable
from pathlib import Path

import h5py

from .trajectory_file import TrajectoryFileError, unit_of

# gzip takes a third longer to write than lzf (6 against 4.5 ms a snapshot of 4096 particles) and
# saves a sixth instead of a tenth; any HDF5 reads it.
COMPRESSION = {"compression": "gzip", "compression_opts": 1, "shuffle": True}
_OPENING = {"libver": "v110", "locking": "best-effort"}  # v110: the oldest that can grow this way


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
        raise unwritable(path, error) from None


def begin(path: Path, fill: Callable[[h5py.File], None]) -> h5py.File:
    """A file that `fill` fills, put in its place once it can grow safely."""
    part = path.with_name(path.name + ".part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        file = h5py.File(part, "w", **_OPENING)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise unwritable(path, error) from None
    try:
        fill(file)
        file.swmr_mode = True
        os.replace(part, path)
    except BaseException as error:
        abandon(file)
        part.unlink(missing_ok=True)
        if isinstance(error, (OSError, RuntimeError)):
            raise unwritable(path, error) from None
        raise
    return file


def abandon(file: h5py.File) -> None:
    """Close without writing: HDF5 never lets go of what it failed to write, so it goes nowhere."""
    nowhere = os.open(os.devnull, os.O_RDWR)
    os.dup2(nowhere, file.id.get_vfd_handle())
    os.close(nowhere)
    with contextlib.suppress(OSError, RuntimeError):
        file.close()


def add_dataset(file, name, shape, dtype, **options) -> h5py.Dataset:
    """An empty dataset of snapshots, `shape` each, with the unit of its name."""
    dataset = file.create_dataset(
        name,
        (0, *shape),
        dtype,
        maxshape=(None, *shape),
        chunks=(1, *shape) if shape else (256,),
        **options,
    )
    dataset.attrs["unit"] = unit_of(name)
    return dataset


def unwritable(path: Path, error: Exception) -> TrajectoryFileError:
    """What to tell of a file that the disk does not take."""
    quoted = re.search(r"error message = '([^']*)'", str(error))  # as HDF5 has it
    reason = quoted[1] if quoted else getattr(error, "strerror", None) or str(error)
    return TrajectoryFileError(
        f"{path}: cannot be written ({reason}); choose a folder that you may write to and that "
        "has room."
    )
