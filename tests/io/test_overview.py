"""What a file tells of its run, and single snapshots of it."""

import numpy as np
import pytest

from jaxsph.io import (
    TrajectoryFileError,
    TrajectoryWriter,
    read_checkpoint,
    read_overview,
    read_snapshot,
    read_trajectory,
)
from tests.runs import random_run


def test_overview(tmp_path):
    path = random_run(tmp_path / "t.h5", count=3, dim=3, dtype="float32")
    overview = read_overview(path)
    assert (overview.scene, overview.particles, overview.dim) == ("taylor-green-3d", 4096, 3)
    assert overview.effects[:2] == ("KernelCorrection", "AdjointPressure")
    assert overview.mass == pytest.approx(1000.0 / 16**3)
    assert (overview.snapshots, overview.complete, overview.dtype) == (3, False, "float32")
    assert overview.step == 2 * overview.schedule.steps_per_snapshot < overview.schedule.steps
    assert overview.time == pytest.approx(overview.step * overview.schedule.time_step)
    assert overview.size == path.stat().st_size and "jaxsph" in overview.versions
    empty = read_overview(random_run(tmp_path / "empty.h5", count=0))
    assert (empty.snapshots, empty.step, empty.time) == (0, -1, 0.0)


def test_single_snapshots(tmp_path):
    path = random_run(tmp_path / "t.h5")
    run = read_trajectory(path)
    for number in (0, 3, -1):
        time, snapshot = read_snapshot(path, number)
        assert time == run.time[number] and snapshot.coordinates is None
        np.testing.assert_array_equal(snapshot.pressure, run.pressure[number])
    with pytest.raises(TrajectoryFileError, match="no snapshot of number 5; it has 5 of them"):
        read_snapshot(path, 5)
    with pytest.raises(TrajectoryFileError, match="holds no snapshot yet"):
        read_snapshot(random_run(tmp_path / "empty.h5", count=0))


def test_checkpoint_of_a_step(tmp_path):
    path = random_run(tmp_path / "t.h5")
    interval = read_overview(path).schedule.steps_per_snapshot
    found = read_checkpoint(path, 2 * interval)
    assert found.step == 2 * interval
    np.testing.assert_array_equal(found.state.density, read_trajectory(path).density[2])
    there = f"those of steps 0, {interval}, {2 * interval}, ... to {4 * interval}"
    with pytest.raises(TrajectoryFileError, match=f"no snapshot of step 1; it has {there}"):
        read_checkpoint(path, 1)


def test_a_branch_begins_with_what_came_before(tmp_path):
    source = random_run(tmp_path / "t.h5", finish=True)
    interval = read_overview(source).schedule.steps_per_snapshot
    before = source.read_bytes()
    with TrajectoryWriter.branch(source, tmp_path / "new" / "t.h5", 2 * interval) as writer:
        assert writer.last_step == 2 * interval
    assert source.read_bytes() == before
    whole, part = read_trajectory(source), read_trajectory(tmp_path / "new" / "t.h5")
    for name in ("time", "position", "velocity", "density", "pressure"):
        np.testing.assert_array_equal(getattr(part, name), getattr(whole, name)[:3])
    assert not read_overview(tmp_path / "new" / "t.h5").complete
    assert "run_seconds" not in part.metadata  # of the whole run
    with pytest.raises(TrajectoryFileError, match="exists already"):
        TrajectoryWriter.branch(source, source, 0)
    with pytest.raises(TrajectoryFileError, match="no snapshot of step 1"):
        TrajectoryWriter.branch(source, tmp_path / "other.h5", 1)
    assert not (tmp_path / "other.h5").exists()
