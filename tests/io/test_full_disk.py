"""A disk that takes no more: one error, nothing half-written, and the process goes on."""

import signal
from contextlib import contextmanager

import h5py
import numpy as np
import pytest

from jaxsph import read_member, read_status, run_scene, sweep
from jaxsph.arrangements import JitteredLattice
from jaxsph.io import (
    TrajectoryFileError,
    TrajectoryWriter,
    read_trajectory,
    whole_file,
    write_vtkhdf,
)
from jaxsph.scenes import taylor_green
from jaxsph.sweeps import SweepFileError
from jaxsph.trajectory import Snapshot
from tests.runs import random_run

resource = pytest.importorskip("resource")  # where processes have limits

FIELDS = ("position", "velocity", "density", "pressure")
SIZES = (0, 100, 3_000, 7_000, 30_000)  # bytes at which the disk is full


@contextmanager
def full_at(size):
    """Files of this process may have `size` bytes; to the writer this is as a full disk."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    usual = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, usual)


@pytest.mark.parametrize("size", SIZES)
def test_whole_files(tmp_path, size):
    path = tmp_path / "x.h5"
    path.write_text("what was there")
    refused = pytest.raises(TrajectoryFileError, match="cannot be written .File too")
    with full_at(size), refused, whole_file(path) as file:
        file["x"] = np.arange(10_000.0)
        file.create_dataset("y", data=np.arange(3000.0), compression="gzip")
        file.flush()
        file.attrs["z"] = "more"
    assert path.read_text() == "what was there"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["x.h5"]
    with whole_file(path) as file:
        file["x"] = np.arange(10_000.0)
    with h5py.File(path) as file:
        np.testing.assert_array_equal(file["x"], np.arange(10_000.0))


@pytest.mark.parametrize("size", SIZES)
def test_exported_files(tmp_path, size):
    source = random_run(tmp_path / "t.h5")
    with full_at(size), pytest.raises(TrajectoryFileError, match="cannot be written"):
        write_vtkhdf(source, tmp_path / "t.vtkhdf")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["t.h5"]


@pytest.fixture(scope="module")
def run():
    scene = taylor_green(12, arrangement=JitteredLattice(), end_time=0.04)
    return scene, run_scene(scene)


@pytest.mark.parametrize("size", (*SIZES, 45_000, 50_000, 55_000))
def test_trajectories(tmp_path, size, run):
    """What was stored before stays readable; each size meets another step of the writing."""
    scene, whole = run
    path = tmp_path / "t.h5"
    refused = pytest.raises(TrajectoryFileError, match="cannot be written")
    with full_at(size), refused, TrajectoryWriter.create(path, scene) as writer:
        for k in range(9):
            snapshot = Snapshot(*(getattr(whole, name)[k % 2] for name in FIELDS))
            writer.append(2 * k, 0.02 * k, snapshot)
        writer.finish(whole.metadata)
    left = sorted(p.name for p in tmp_path.iterdir())
    assert left in ([], ["t.h5"])
    if left:
        try:
            kept = read_trajectory(path)
        except TrajectoryFileError as error:
            assert "no snapshot yet" in str(error)
        else:
            for k, velocity in enumerate(kept.velocity):
                np.testing.assert_array_equal(velocity, whole.velocity[k % 2])


def test_a_sweep_takes_its_room_first(tmp_path):
    scenes = [taylor_green(12, re, arrangement=JitteredLattice(), end_time=0.04)
              for re in (100.0, 200.0)]  # fmt: skip
    path = tmp_path / "sweep.h5"
    for size in (*SIZES, 40_000):
        with full_at(size), pytest.raises(SweepFileError, match="cannot be written"):
            sweep(scenes, path)
        assert list(tmp_path.iterdir()) == []
    sweep(scenes, path)
    size = path.stat().st_size
    assert path.stat().st_blocks * 512 >= size
    kept = read_member(path, 1)
    with h5py.File(path, "r+") as file:
        file["code"][1] = -1
        first = file["velocity"].id.get_offset()
    with full_at(first), pytest.raises(SweepFileError, match="cannot be written"):
        sweep(scenes, path)
    np.testing.assert_array_equal(read_status(path).code, [0, -1])
    sweep(scenes, path)
    np.testing.assert_array_equal(read_member(path, 1).velocity, kept.velocity)
