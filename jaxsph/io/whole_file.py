"""HDF5 files that are written whole or not at all, whatever the disk does."""

from __future__ import annotations

import io
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import h5py

from .growing_file import check_target, unwritable


@contextmanager
def whole_file(path: str | os.PathLike) -> Iterator[h5py.File]:
    """A file to fill, which takes its place once all of it is on the disk; else none is left.

    What room HDF5 reserves in it is reserved on the disk as well.

    Raises:
        TrajectoryFileError: if the file cannot be written.
    """
    path = Path(path)
    check_target(path)
    unfinished = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with open(unfinished, "w+b", buffering=0) as target:
            shield = _Shield(target)
            try:
                with h5py.File(shield, "w") as file:
                    yield file
            except RuntimeError as error:
                raise shield.failure or error from None
            if shield.failure is not None:
                raise shield.failure
            if hasattr(os, "posix_fallocate"):
                os.posix_fallocate(target.fileno(), 0, os.fstat(target.fileno()).st_size)
            os.fsync(target.fileno())
        os.replace(unfinished, path)
    except OSError as error:
        raise unwritable(path, error) from None
    finally:
        unfinished.unlink(missing_ok=True)


class _Shield(io.RawIOBase):
    """A file whose first failure is kept for later.

    HDF5 never lets go of what it failed to write: it tries again at every flush, and ends the
    process at last. So all that follows a failure seems to succeed.
    """

    def __init__(self, file: io.FileIO):
        self._file, self.failure = file, None

    def _tried(self, action, otherwise):
        if self.failure is None:
            try:
                return action()
            except OSError as error:
                self.failure = error
        return otherwise

    def seek(self, offset, whence=io.SEEK_SET):
        return self._file.seek(offset, whence)

    def tell(self):
        return self._file.tell()

    def readinto(self, buffer):
        read = self._file.readinto(buffer)
        memoryview(buffer)[read:] = bytes(len(buffer) - read)  # of what was not written
        return len(buffer)

    def write(self, data):
        return self._tried(lambda: self._written(data), len(data))

    def _written(self, data):
        left = memoryview(data)
        while left:
            left = left[self._file.write(left) :]
        return len(data)

    def truncate(self, size=None):
        return self._tried(lambda: self._file.truncate(size), size)

    def flush(self):
        """Nothing is held back."""
