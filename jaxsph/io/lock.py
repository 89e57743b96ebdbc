"""One process at a time writes a file: a lock beside it, freed by the system when that one ends."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import socket
from pathlib import Path
from typing import IO

from .growing_file import unwritable
from .trajectory_file import TrajectoryFileError

try:
    import fcntl
except ImportError:  # where the system has none
    fcntl = None

_WITHOUT_LOCKS = (errno.ENOSYS, errno.ENOLCK, errno.EOPNOTSUPP)  # says a file system


class Lock:
    """Holds `PATH.lock` until it is released; one that a dead process left is taken over.

    Where the system or the file system knows no locks there is none.

    Args:
        path: of the file to be written.

    Raises:
        TrajectoryFileError: if another process, or another writer in this one, holds it.
    """

    def __init__(self, path: Path):
        self._path, self._file = path.with_name(path.name + ".lock"), None
        if fcntl is None:
            return
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = _held(self._path)
        except BlockingIOError:
            raise TrajectoryFileError(
                f"{path}: is being written by {_holder(self._path)}; wait for that, or name "
                "another file or folder."
            ) from None
        except OSError as error:
            raise unwritable(path, error) from None
        own = {"process": os.getpid(), "host": socket.gethostname()}
        with contextlib.suppress(OSError):  # on a full disk the lock holds without its text
            os.ftruncate(self._file.fileno(), 0)
            os.write(self._file.fileno(), json.dumps(own).encode())

    def release(self) -> None:
        """Let others write; nothing happens if it is released."""
        if self._file is not None and not self._file.closed:
            self._path.unlink(missing_ok=True)  # first, or another's could go
            self._file.close()

    def __enter__(self) -> Lock:
        return self

    def __exit__(self, *exception) -> None:
        self.release()


def _held(path: Path) -> IO[bytes]:
    """The lock file, locked, and still the one of that name."""
    while True:
        file = open(path, "ab", buffering=0)  # noqa: SIM115 (closed by `release`)
        try:
            _flock(file)
            with contextlib.suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(file.fileno()), path.stat()):
                    return file
        except BaseException:
            file.close()
            raise
        file.close()  # its holder has just removed it


def _flock(file: IO[bytes]) -> None:
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno not in _WITHOUT_LOCKS:
            raise


def _holder(path: Path) -> str:
    with contextlib.suppress(OSError, ValueError, KeyError, TypeError):
        found = json.loads(path.read_text())
        if found["process"] == os.getpid() and found["host"] == socket.gethostname():
            return "this process already"
        return f"process {found['process']} on {found['host']}"
    return "another process"
