"""Kept runs that do not belong are never used and never overwritten."""

import dataclasses
import multiprocessing
from contextlib import contextmanager

import equinox as eqx
import h5py
import jax
import jax.numpy as jnp
import pytest

from jaxsph.arrangements import Lattice
from jaxsph.effects import Gravity
from jaxsph.io import TrajectoryFileError, TrajectoryWriter
from jaxsph.scenes import taylor_green
from jaxsph_rom import Energy, Experiment, OnParticles, Study
from jaxsph_rom.study import full_run
from jaxsph_rom.study.full_runs import silent

EXPERIMENT = Experiment((100.0,), (100.0,), (2,))


def make(reynolds=100.0):
    return taylor_green(12, reynolds, arrangement=Lattice(), end_time=0.05)


def swirled(reynolds=100.0):
    scene = make(reynolds)
    return eqx.tree_at(lambda s: s.state.velocity, scene, 0.5 * scene.state.velocity)


def heavy(reynolds=100.0):
    scene = make(reynolds)
    return dataclasses.replace(scene, effects=(*scene.effects, Gravity(jnp.array([0.0, -1.0]))))


class Strong(Energy):
    """Counts velocity ten times."""

    def weights(self, fluid, dim):
        return Energy.weights(self, fluid, dim) * jnp.asarray([1.0] + [10.0] * dim)


Strong.__name__ = "Energy"  # so that its runs go where those of the other one are


def test_another_scene_in_the_same_folder_is_refused(tmp_path):
    kept = full_run(tmp_path, make(), silent)
    (path,) = tmp_path.rglob("*.h5")
    before = path.read_bytes()
    for other, named in ((swirled, "state.velocity"), (heavy, r"effects\[7\]")):
        with pytest.raises(TrajectoryFileError, match=named):
            full_run(tmp_path, other(), silent)
    assert path.read_bytes() == before
    assert (full_run(tmp_path, make(), silent).velocity == kept.velocity).all()
    with h5py.File(path, "r+") as file:
        del file.attrs["content"]
    with pytest.raises(TrajectoryFileError, match="did not keep what was run"):
        full_run(tmp_path, make(), silent)


def test_another_study_in_the_same_folder_is_refused(tmp_path):
    list(Study(make, tmp_path).run(EXPERIMENT))
    with pytest.raises(TrajectoryFileError, match="state.velocity"):
        list(Study(swirled, tmp_path).run(EXPERIMENT))
    with pytest.raises(TrajectoryFileError, match="made_by.method.product"):
        list(Study(make, tmp_path, OnParticles(product=Strong())).run(EXPERIMENT))


def test_a_scene_without_a_reynolds_number_is_kept_by_its_content(tmp_path):
    for scene in (make(), swirled()):
        own = dataclasses.replace(scene, name="own", parameters={})
        full_run(tmp_path, own, silent)
    assert len(list(tmp_path.glob("own-*"))) == 2


def hold(path, held, done):
    with jax.enable_x64(True), TrajectoryWriter.create(path, make()):
        held.set()
        done.wait(60)


def test_a_run_that_another_process_writes_is_refused(tmp_path):
    path = tmp_path / "re-100" / "trajectory.h5"
    fork = multiprocessing.get_context("spawn")
    held, done = fork.Event(), fork.Event()
    other = fork.Process(target=hold, args=(path, held, done))
    other.start()
    assert held.wait(60)
    with pytest.raises(TrajectoryFileError, match=f"is being written by process {other.pid} on "):
        full_run(tmp_path, make(), silent)
    other.kill()  # its lock file stays
    other.join()
    assert path.with_name("trajectory.h5.lock").exists()
    assert len(full_run(tmp_path, make(), silent).time) == make().steps // 2 + 1
    assert sorted(p.name for p in path.parent.iterdir()) == ["trajectory.h5"]


def test_a_run_that_another_process_has_cut_is_not_handed_on(tmp_path):
    """The last step is checked after reading."""
    path = tmp_path / "re-100" / "trajectory.h5"

    @contextmanager
    def replaced_meanwhile(label, total, done):
        yield lambda steps: None
        path.unlink()
        with TrajectoryWriter.create(tmp_path / "other.h5", make()):
            pass
        (tmp_path / "other.h5").rename(path)

    with pytest.raises(TrajectoryFileError, match="holds no snapshot|by another process"):
        full_run(tmp_path, make(), replaced_meanwhile)
