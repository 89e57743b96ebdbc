"""Trajectory files give back what was put in, whatever happens to the process that writes them."""

import os
import subprocess
import sys
import time
from pathlib import Path

import h5py
import jax
import numpy as np
import pytest

import jaxsph
from jaxsph.arrangements import Lattice
from jaxsph.io import TrajectoryFileError, TrajectoryWriter, read_checkpoint, read_trajectory
from jaxsph.scenes import taylor_green
from jaxsph.trajectory import Snapshot

FIELDS = ("position", "velocity", "density", "pressure")
ROOT = Path(jaxsph.__file__).parents[1]
# Writes snapshots whose every value is the number of the step, as fast as it can.
WRITE_ON = """
import sys, numpy as np
from jaxsph.arrangements import Lattice
from jaxsph.io import TrajectoryWriter
from jaxsph.scenes import taylor_green
from jaxsph.trajectory import Snapshot
scene = taylor_green(16, arrangement=Lattice())
{setting}
with TrajectoryWriter.create(sys.argv[1], scene) as writer:
    for k in range({count}):
        pair, single = np.full((256, 2), float(k)), np.full(256, float(k))
        writer.append(k, 0.1 * k, Snapshot(pair, pair, single, single))
"""


@pytest.fixture(scope="module")
def scene():
    return taylor_green(16, end_time=0.06, arrangement=Lattice())


def snapshot(number, particles=256, dtype=np.float64, modes=None):
    pair, single = np.full((particles, 2), number, dtype), np.full(particles, number, dtype)
    return Snapshot(pair, pair + 1, single, single + 1, None if modes is None else single[:modes])


def write(path, scene, count=4, **options):
    with TrajectoryWriter.create(path, scene, **options) as writer:
        for k in range(count):
            writer.append(k, 0.1 * k, snapshot(k, modes=options.get("modes")))
    return path


def start(path, count, setting=""):
    script = WRITE_ON.format(count=count, setting=setting)
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.Popen(
        [sys.executable, "-c", script, str(path)], env=environment, stderr=subprocess.PIPE
    )


def test_gives_back_a_run(tmp_path, scene):
    path = tmp_path / "new" / "folder" / "trajectory.h5"
    with TrajectoryWriter.create(path, scene) as writer:
        made = jaxsph.run_scene(scene, recorder=writer)
        writer.finish(made.metadata)
    read = read_trajectory(path)
    assert read.metadata == made.metadata
    for name in ("time", *FIELDS):
        np.testing.assert_array_equal(getattr(read, name), getattr(made, name))
        assert getattr(read, name).dtype == getattr(made, name).dtype
    assert read.coordinates is None


def test_layout(tmp_path, scene):
    with h5py.File(write(tmp_path / "t.h5", scene, metadata={"note": "x"})) as file:
        assert file.attrs["format"] == "jaxsph trajectory"
        assert file.attrs["schema_version"] == 1
        assert not file.attrs["complete"]
        assert file.attrs["steps"] == scene.steps
        assert file.attrs["time_step"] == scene.time_step
        for name, unit in {
            "time": "s",
            "position": "m",
            "velocity": "m/s",
            "density": "kg/m^3",
            "pressure": "Pa",
        }.items():
            assert file[name].attrs["unit"] == unit
            assert file[name].maxshape[0] is None
        assert file["position"].chunks == (1, 256, 2)
        assert file["position"].compression == "gzip"


def test_incomplete_run_knows_how_far_it_came(tmp_path, scene):
    read = read_trajectory(write(tmp_path / "t.h5", scene, count=3))
    assert read.metadata["steps"] == 2
    assert read.metadata["time_step"] == scene.time_step
    assert read.metadata["parameters"] == scene.parameters
    checkpoint = read_checkpoint(tmp_path / "t.h5")
    assert (checkpoint.step, checkpoint.complete) == (2, False)
    np.testing.assert_array_equal(checkpoint.state.velocity, snapshot(2).velocity)


def test_reduced_coordinates_and_single_precision(tmp_path, scene):
    read = read_trajectory(write(tmp_path / "modes.h5", scene, modes=5))
    np.testing.assert_array_equal(read.coordinates, np.arange(4.0)[:, None] * np.ones(5))
    with jax.enable_x64(False):
        single = taylor_green(16, arrangement=Lattice(), dtype="float32")
    assert read_trajectory(write(tmp_path / "single.h5", single)).velocity.dtype == np.float32


def test_kill_leaves_whole_snapshots(tmp_path, scene):
    path = tmp_path / "t.h5"
    process = start(path, count=10**6)
    until = time.monotonic() + 60
    while not path.exists() and time.monotonic() < until:
        time.sleep(0.01)
    time.sleep(0.3)
    alive = read_trajectory(path)  # a file that grows can be read as well
    process.kill()
    process.communicate()
    read = read_trajectory(path)
    count = len(read.time)
    assert count >= len(alive.time) > 1
    for name in FIELDS:
        first = getattr(read, name).reshape(count, -1)
        np.testing.assert_array_equal(first, np.arange(float(count))[:, None] + 0 * first)
    with TrajectoryWriter.append_to(path) as writer:
        assert writer.last_step == count - 1
        writer.append(count - 1, 0.0, snapshot(-1))  # is there already
        writer.append(count, 0.1 * count, snapshot(count))
        writer.finish()
    resumed = read_trajectory(path)
    np.testing.assert_array_equal(resumed.position[:-1], read.position)
    np.testing.assert_array_equal(resumed.position[-1], snapshot(count).position)
    assert read_checkpoint(path).complete
    assert [p.name for p in tmp_path.iterdir()] == ["t.h5"]


def test_full_disk_leaves_whole_snapshots(tmp_path):
    resource = pytest.importorskip("resource")
    assert resource
    limit = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, 60_000))"
    process = start(tmp_path / "t.h5", 10**4, limit)
    error = process.communicate(timeout=60)[1].decode()
    assert process.returncode == 1  # an exception, not a crash within HDF5
    assert "TrajectoryFileError" in error and "cannot be written (File too large)" in error
    read = read_trajectory(tmp_path / "t.h5")
    np.testing.assert_array_equal(read.density[:, 0], np.arange(float(len(read.time))))


def test_half_written_row_is_left_out(tmp_path, scene):
    path = write(tmp_path / "t.h5", scene)
    with h5py.File(path, "r+") as file:
        for name in ("position", "velocity", "time"):
            file[name].resize(5, 0)
    assert len(read_trajectory(path).time) == 4
    with TrajectoryWriter.append_to(path) as writer:
        writer.append(4, 0.4, snapshot(4))
    with h5py.File(path) as file:
        assert {len(file[name]) for name in file} == {5}
    np.testing.assert_array_equal(read_trajectory(path).position[4], snapshot(4).position)


def spoil_format(file):
    file.attrs["format"] = "something else"


def spoil_version(file):
    file.attrs["schema_version"] = 99


def spoil_dataset(file):
    del file["pressure"]


def spoil_attribute(file):
    del file.attrs["parameters"]


def spoil_shape(file):
    del file["density"]
    file["density"] = np.zeros((4, 7))


def spoil_json(file):
    file.attrs["metadata"] = "{"


def spoil_length(file):
    file["velocity"].resize(2, 0)
    file.attrs["complete"] = True


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (spoil_format, "not a jaxsph trajectory"),
        (spoil_version, "schema version 99, this jaxsph reads 1"),
        (spoil_dataset, "lacks dataset 'pressure'"),
        (spoil_attribute, "lacks attribute 'parameters'"),
        (spoil_shape, "disagree on the number of particles"),
        (spoil_json, "truncated or damaged"),
        (spoil_length, "truncated or damaged"),
    ],
)
def test_spoilt_file(tmp_path, scene, spoil, message):
    path = write(tmp_path / "t.h5", scene)
    with h5py.File(path, "r+") as file:
        spoil(file)
    with pytest.raises(TrajectoryFileError, match=message) as caught:
        read_trajectory(path)
    assert str(path) in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("kept", [9, 100, 1000, 0.3, 0.5, 0.7, 0.9, 0.99])
def test_truncated_file(tmp_path, scene, kept):
    path = write(tmp_path / "t.h5", scene)
    content = path.read_bytes()
    path.write_bytes(content[: kept if kept >= 1 else int(kept * len(content))])
    with pytest.raises(TrajectoryFileError, match="truncated or damaged"):
        read_trajectory(path)


def test_no_trajectory_file(tmp_path, scene):
    with pytest.raises(TrajectoryFileError, match="no such file"):
        read_trajectory(tmp_path / "missing.h5")
    with pytest.raises(TrajectoryFileError, match="Is a directory"):
        read_trajectory(tmp_path)
    (tmp_path / "text.h5").write_text("hello")
    with pytest.raises(TrajectoryFileError, match="not an HDF5 file"):
        read_trajectory(tmp_path / "text.h5")
    with h5py.File(tmp_path / "foreign.h5", "w") as file:
        file["x"] = 1
    with pytest.raises(TrajectoryFileError, match="not a jaxsph trajectory"):
        TrajectoryWriter.append_to(tmp_path / "foreign.h5")
    with pytest.raises(TrajectoryFileError, match="no snapshot yet"):
        read_trajectory(write(tmp_path / "empty.h5", scene, count=0))


def test_existing_file_is_kept_unless_told(tmp_path, scene):
    path = write(tmp_path / "t.h5", scene)
    with pytest.raises(TrajectoryFileError, match="exists already"):
        TrajectoryWriter.create(path, scene)
    assert len(read_trajectory(path).time) == 4
    assert len(read_trajectory(write(path, scene, 2, overwrite=True)).time) == 2


def test_folder_that_does_not_serve(tmp_path, scene):
    (tmp_path / "file").write_text("")
    with pytest.raises(TrajectoryFileError, match="cannot be written .Not a directory"):
        TrajectoryWriter.create(tmp_path / "file" / "t.h5", scene)
    (tmp_path / "closed").mkdir(mode=0o500)
    if not os.access(tmp_path / "closed", os.W_OK):  # a superuser may write anywhere
        with pytest.raises(TrajectoryFileError, match="cannot be written .Permission denied"):
            TrajectoryWriter.create(tmp_path / "closed" / "t.h5", scene)


def test_metadata_must_fit(tmp_path, scene):
    with (
        TrajectoryWriter.create(tmp_path / "t.h5", scene) as writer,
        pytest.raises(TrajectoryFileError, match="do not fit"),
    ):
        writer.finish({"long": "x" * 10**5})
