"""One writer at a time, and no lock outlives its process."""

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

import jaxsph
from jaxsph.io import Lock, TrajectoryFileError

fcntl = pytest.importorskip("fcntl")

ROOT = Path(jaxsph.__file__).parents[1]
HOLD = (
    "import sys; from pathlib import Path; from jaxsph.io import Lock\n"
    "lock = Lock(Path(sys.argv[1])); print('held', flush=True); sys.stdin.read()"
)


def test_one_holder_at_a_time(tmp_path):
    path = tmp_path / "new" / "t.h5"
    with Lock(path) as lock:
        with pytest.raises(TrajectoryFileError, match="is being written by this process already"):
            Lock(path)
        lock.release()
        with Lock(path):  # let go twice does not take the next one's away
            lock.release()
            assert path.with_name("t.h5.lock").exists()
    assert list(path.parent.iterdir()) == []


def test_a_lock_ends_with_its_process(tmp_path):
    path = tmp_path / "t.h5"
    command = [sys.executable, "-c", HOLD, str(path)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(
        command, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout.readline() == "held\n"
        with pytest.raises(TrajectoryFileError, match=f"by process {process.pid} on .*; wait for"):
            Lock(path)
        process.kill()
    assert (tmp_path / "t.h5.lock").exists()
    Lock(path).release()
    assert list(tmp_path.iterdir()) == []


def test_a_file_system_without_locks_has_none(tmp_path, monkeypatch):
    def refuse(*_):
        raise OSError(errno.ENOLCK, "no locks")

    monkeypatch.setattr(fcntl, "flock", refuse)
    with Lock(tmp_path / "t.h5"), Lock(tmp_path / "t.h5"):
        pass
    assert list(tmp_path.iterdir()) == []
