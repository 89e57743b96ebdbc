"""Blocks of snapshots put together are the trajectory in the file, and only they are read."""

import tracemalloc

import h5py
import numpy as np
import pytest

from jaxsph.arrangements import Lattice
from jaxsph.io import TrajectoryFileError, TrajectoryWriter, read_trajectory, snapshot_blocks
from jaxsph.scenes import taylor_green
from jaxsph.trajectory import Snapshot

FIELDS = ("time", "position", "velocity", "density", "pressure")


@pytest.fixture(scope="module")
def scene():
    return taylor_green(16, end_time=0.06, arrangement=Lattice())


def write(path, scene, count=7, modes=None, finish=False):
    """A file of random snapshots."""
    rng = np.random.default_rng(count)
    with TrajectoryWriter.create(path, scene, modes=modes, overwrite=True) as writer:
        for k in range(count):
            pairs, singles = rng.normal(size=(2, 256, 2)), rng.normal(size=(2, 256))
            coordinates = None if modes is None else rng.normal(size=modes)
            writer.append(k, 0.1 * k, Snapshot(*pairs, *singles, coordinates))
        if finish:
            writer.finish({"scene": scene.name, "run_seconds": 1.0})
    return path


@pytest.mark.parametrize("finish", [True, False])
@pytest.mark.parametrize("size, lengths", [(1, [1] * 7), (3, [3, 3, 1]), (7, [7]), (50, [7])])
def test_put_together_they_are_the_trajectory(tmp_path, scene, size, lengths, finish):
    path = write(tmp_path / "t.h5", scene, modes=4, finish=finish)
    whole, blocks = read_trajectory(path), list(snapshot_blocks(str(path), size))
    assert [len(block.time) for block in blocks] == lengths
    for name in (*FIELDS, "coordinates"):
        joined = np.concatenate([getattr(block, name) for block in blocks])
        np.testing.assert_array_equal(joined, getattr(whole, name))
        assert joined.dtype == getattr(whole, name).dtype
    assert all(block.metadata == whole.metadata for block in blocks)


def test_a_full_run_has_no_coordinates(tmp_path, scene):
    assert next(snapshot_blocks(write(tmp_path / "t.h5", scene), 2)).coordinates is None


def test_one_block_is_held_at_a_time(tmp_path, scene):
    path = write(tmp_path / "t.h5", scene, count=200)
    block = 5 * 256 * 6 * 8  # bytes of 5 snapshots
    sum(len(b.time) for b in snapshot_blocks(path, 5))  # h5py's own caches
    tracemalloc.start()
    try:
        assert sum(float(np.sum(b.density)) for b in snapshot_blocks(path, 5)) != 0.0
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 3 * block  # that being read, that in use; the trajectory has 40


def test_what_a_run_adds_meanwhile_is_left_out(tmp_path, scene):
    path = tmp_path / "t.h5"
    one = np.zeros((256, 2)), np.zeros((256, 2)), np.ones(256), np.zeros(256)
    with TrajectoryWriter.create(path, scene) as writer:
        for k in range(3):
            writer.append(k, 0.1 * k, Snapshot(*one))
        blocks = snapshot_blocks(path, 2)
        writer.append(3, 0.3, Snapshot(*one))
        assert [len(block.time) for block in blocks] == [2, 1]
        assert [b.metadata["steps"] for b in snapshot_blocks(path, 4)] == [3]


def test_another_run_in_its_place_is_noticed(tmp_path, scene):
    path = write(tmp_path / "t.h5", scene)
    blocks = snapshot_blocks(path, 3)
    next(blocks)
    write(path, scene, count=4)  # fewer snapshots
    with pytest.raises(TrajectoryFileError, match="replaced by another run"):
        next(blocks)
    blocks = snapshot_blocks(path, 3)
    next(blocks)
    write(path, taylor_green(16, reynolds=50.0, end_time=0.06, arrangement=Lattice()))
    with pytest.raises(TrajectoryFileError, match="replaced by another run") as caught:
        next(blocks)
    assert str(path) in str(caught.value) and "\n" not in str(caught.value)


def test_what_cannot_be_read_is_refused_at_the_call(tmp_path, scene):
    path = write(tmp_path / "t.h5", scene)
    with pytest.raises(ValueError, match="size: 0 snapshots a block"):
        snapshot_blocks(path, 0)
    with pytest.raises(TrajectoryFileError, match="no such file"):
        snapshot_blocks(tmp_path / "missing.h5", 5)
    with pytest.raises(TrajectoryFileError, match="no snapshot yet"):
        snapshot_blocks(write(tmp_path / "empty.h5", scene, count=0), 5)
    with h5py.File(path, "r+") as file:
        file.attrs["metadata"] = "{"
    with pytest.raises(TrajectoryFileError, match="truncated or damaged"):
        snapshot_blocks(path, 5)
    content = write(path, scene).read_bytes()
    path.write_bytes(content[: len(content) // 2])
    with pytest.raises(TrajectoryFileError, match="truncated or damaged"):
        snapshot_blocks(path, 5)


def test_a_file_damaged_between_blocks_is_refused(tmp_path, scene):
    path = write(tmp_path / "t.h5", scene)
    blocks = snapshot_blocks(path, 3)
    next(blocks)
    path.write_bytes(path.read_bytes()[:1000])
    with pytest.raises(TrajectoryFileError, match="truncated or damaged"):
        next(blocks)
