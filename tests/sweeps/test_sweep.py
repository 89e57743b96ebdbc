"""Sweeps of full models: equal to single runs, on many devices and processes, after a kill."""

import dataclasses
import json
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import equinox as eqx
import h5py
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import run_scene
from jaxsph.arrangements import JitteredLattice
from jaxsph.cli import main
from jaxsph.integrate import FaultCode
from jaxsph.io import Lock, TrajectoryFileError, read_forces
from jaxsph.scenes import lid_driven_cavity, taylor_green
from jaxsph.sweeps import (
    SweepFileError,
    read_member,
    read_member_forces,
    read_status,
    sweep,
    sweep_file,
)
from jaxsph.sweeps.member_run import _judged
from jaxsph.sweeps.members import stacked
from tests.walls.test_free_body import scene as tank

ROOT = Path(__file__).parents[2]
SNAPSHOTS = 4  # of each member
_RUN = """
import sys
import jax
jax.config.update("jax_enable_x64", True)
jax.config.update("jax_num_cpu_devices", int(sys.argv[1]))
if len(sys.argv) > 3:
    jax.distributed.initialize(sys.argv[3], int(sys.argv[4]), int(sys.argv[5]))
from jaxsph.sweeps import sweep
from tests.sweeps.test_sweep import members
status = sweep(members(int(sys.argv[6]) if len(sys.argv) > 6 else 10), sys.argv[2],
               progress=lambda _: print("member", flush=True))
assert (status.code == 0).all()
if len(sys.argv) > 3:  # a file in a folder that is none, known to one of the processes
    try:
        sweep(members(2), sys.argv[2] + "/beside.h5")
    except ValueError as error:
        print(error)
"""


def members(count):
    return [
        taylor_green(12, 100.0 + 50.0 * k, end_time=0.08, arrangement=JitteredLattice(seed=k))
        for k in range(count)
    ]


def started(*arguments, **environment):
    return subprocess.Popen(
        [sys.executable, "-c", _RUN, *map(str, arguments)], cwd=ROOT, stdout=subprocess.PIPE,
        text=True, env={**os.environ, "JAX_PLATFORMS": "cpu", "PYTHONPATH": str(ROOT)},
    )  # fmt: skip


def assert_is_single_runs(path, scenes):
    """Each program rounds its sums in an order of its own; eight steps grow that a little."""
    for k, scene in enumerate(scenes):
        found, wanted = read_member(path, k), run_scene(scene)
        np.testing.assert_allclose(found.time, wanted.time, rtol=1e-15)
        for name in ("position", "velocity", "density", "pressure"):
            a, b = getattr(found, name), getattr(wanted, name)
            np.testing.assert_allclose(a, b, atol=1e-12 * np.abs(b).max(), err_msg=f"{k} {name}")
        assert found.metadata["parameters"] == json.loads(json.dumps(scene.parameters))


@pytest.mark.parametrize("batch", [1, 2])
def test_members_are_single_runs(tmp_path, batch):
    scenes = members(3)  # not a multiple of the batch
    done = []
    status = sweep(scenes, tmp_path / "sweep.h5", batch=batch, progress=done.append)
    assert sum(done) == 3
    np.testing.assert_array_equal(status.code, 0)
    np.testing.assert_array_equal(status.snapshots, SNAPSHOTS)
    assert_is_single_runs(tmp_path / "sweep.h5", scenes)


def test_eight_devices_share_members_out(tmp_path):
    path = tmp_path / "sweep.h5"
    with started(8, path) as process:
        process.communicate()
    assert process.returncode == 0
    assert_is_single_runs(path, members(10))


def test_two_processes_make_one_file(tmp_path):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{free.getsockname()[1]}"
    path = tmp_path / "sweep.h5"
    both = [started(2, path, address, 2, number, 5) for number in range(2)]
    said = [process.communicate(timeout=300)[0] for process in both]
    assert [process.returncode for process in both] == [0, 0]
    assert all("beside.h5" in output for output in said)
    assert_is_single_runs(path, members(5))


def test_a_killed_sweep_goes_on(tmp_path):
    path = tmp_path / "sweep.h5"
    with started(1, path) as process:
        for _ in range(2):
            assert process.stdout.readline() == "member\n"
        process.send_signal(signal.SIGKILL)
    before = read_status(path).code
    assert 2 <= (before == 0).sum() < 10
    kept = path.stat().st_mtime_ns
    done = []
    status = sweep(members(10), path, progress=done.append)
    assert done[0] == (before == 0).sum()
    assert sum(done) == 10
    assert path.stat().st_mtime_ns > kept
    assert_is_single_runs(path, members(10))
    stamp = path.stat().st_mtime_ns
    time.sleep(0.01)
    sweep(members(10), path)  # nothing is left to do
    assert path.stat().st_mtime_ns == stamp
    np.testing.assert_array_equal(status.code, 0)


def test_a_member_that_blows_up_goes_alone(tmp_path):
    scenes = members(3)
    wild = eqx.tree_at(lambda s: s.state.velocity, scenes[1], 30.0 * scenes[1].state.velocity)
    status = sweep([scenes[0], wild, scenes[2]], tmp_path / "sweep.h5", batch=3)
    assert status.code[1] in (FaultCode.NEIGHBORS_OUTDATED, FaultCode.DENSITY_OUT_OF_BOUNDS)
    assert status.step[1] >= 1
    lost = read_member(tmp_path / "sweep.h5", 1)
    assert len(lost.time) == status.snapshots[1] < SNAPSHOTS
    assert np.isfinite(lost.velocity).all()
    np.testing.assert_array_equal(status.code[[0, 2]], 0)


def tanks(count):
    """A body that is free and named, in a fluid of another viscosity each."""
    made = []
    for k in range(count):
        scene = dataclasses.replace(tank(), steps_per_snapshot=3, end_time=0.012)
        viscosity = 0.01 * (1.0 + k)
        made.append(eqx.tree_at(lambda s: s.effects[2].viscosity, scene, jnp.asarray(viscosity)))
    return made


@pytest.mark.run_once
def test_forces_and_free_bodies_are_those_of_single_runs(tmp_path):
    path, scenes = tmp_path / "sweep.h5", tanks(2)
    sweep(scenes, path, batch=2)
    for k, scene in enumerate(scenes):
        found, wanted = read_member(path, k), run_scene(scene, tmp_path / f"{k}.h5")
        for name in ("forces", "torques", "mean_forces", "mean_torques"):
            a, b = getattr(found, name), getattr(wanted, name)
            assert a.keys() == b.keys() == {"walls", "ball"}
            for part in a:
                np.testing.assert_allclose(a[part], b[part], atol=1e-10 * np.abs(b["walls"]).max())
        for a, b in zip(*map(jax.tree.leaves, (found.bodies, wanted.bodies)), strict=True):
            np.testing.assert_allclose(a, b, atol=1e-12)
        told, like = read_member_forces(path, k), read_forces(tmp_path / f"{k}.h5")
        assert {n: (h.averaged, h.scale) for n, h in told.items()} == {
            n: (h.averaged, h.scale) for n, h in like.items()
        }
    assert not np.allclose(read_member(path, 0).forces["ball"], found.forces["ball"])


def test_members_may_refer_their_forces_to_other_speeds(tmp_path):
    """By which coefficients are made, and nothing else."""
    path, (first, second) = tmp_path / "sweep.h5", tanks(2)
    faster = dataclasses.replace(second.fluid, reference_speed=2.0)
    scenes = [first, dataclasses.replace(second, fluid=faster)]
    sweep_file.create(path, scenes)
    with h5py.File(path) as file:
        assert file["references/ball"][:, 0].tolist() == [1.0, 2.0]
    *_, forces = stacked(scenes).structure
    assert forces.reference_speeds == (1.0, 1.0)


def test_members_may_turn_where_others_do_not():
    """A ball that starts at rest, and one that turns."""
    members = stacked([dataclasses.replace(tank(spin=s), end_time=0.012) for s in (0.0, 0.5)])
    *_, forces = members.arrays
    rest, turning = forces.turning.fit
    assert not rest.any() and turning.any()


def test_bad_forces_come_before_a_later_fault():
    """Code, step, particle and number of good snapshots."""
    fault = tuple(jnp.asarray(n, jnp.int32) for n in (FaultCode.BEYOND_WALL, 9, 5, 4))
    for bad, overflow, wanted in (
        ([0, 0, 0, 0], [0, 0, 0, 1], (FaultCode.BEYOND_WALL, 9, 5, 4)),
        ([0, 0, 1, 1], [0, 0, 0, 1], (FaultCode.NOT_FINITE, 6, -1, 2)),
        ([0, 1, 1, 1], [0, 1, 0, 0], (FaultCode.NEIGHBOR_OVERFLOW, 3, -1, 1)),
    ):
        found = _judged(fault, jnp.asarray(bad, bool), jnp.asarray(overflow, bool), 3)
        assert tuple(map(int, found)) == wanted


def test_a_list_that_overflows_is_enlarged(tmp_path, monkeypatch):
    scenes = members(2)
    tight = type(scenes[0]).search

    def search(self, *rest):
        found = tight(self, *rest)
        return eqx.tree_at(lambda s: s, found, type(found)(
            found.grid, found.support, found.skin, found.capacity - 8, found.run_capacity
        ))  # fmt: skip

    monkeypatch.setattr(type(scenes[0]), "search", search)
    status = sweep(scenes, tmp_path / "sweep.h5")
    monkeypatch.undo()
    np.testing.assert_array_equal(status.code, 0)
    assert_is_single_runs(tmp_path / "sweep.h5", scenes)


def test_what_is_no_sweep_is_refused(tmp_path):
    path = tmp_path / "sweep.h5"
    with pytest.raises(ValueError, match="needs at least one"):
        sweep([], path)
    with pytest.raises(ValueError, match="batch: at least 1, got 0"):
        sweep(members(1), path, batch=0)
    with pytest.raises(ValueError, match="number 1 differs from the first in space"):
        sweep([*members(1), taylor_green(16, end_time=0.08, arrangement=JitteredLattice())], path)
    with pytest.raises(ValueError, match="number 1 differs from the first in name"):
        sweep([*members(1), lid_driven_cavity(12)], path)
    assert not path.exists()
    sweep_file.create(path, members(2))
    with pytest.raises(SweepFileError, match="has not been run"):
        read_member(path, 0)
    with pytest.raises(SweepFileError, match="has members 0 to 1, not 2"):
        read_member(path, 2)
    with pytest.raises(SweepFileError, match="holds another sweep"):
        sweep(members(3), path)
    path.write_text("nothing")
    with pytest.raises(SweepFileError, match="cannot be read"):
        read_status(path)


def test_another_sweep_of_the_same_parameters_is_refused(tmp_path):
    """Parameters are a record; what the scenes hold is compared."""
    path = tmp_path / "sweep.h5"
    scenes = members(3)
    sweep_file.create(path, scenes)
    sweep_file.create(path, members(3))
    other = eqx.tree_at(lambda s: s.state.velocity, scenes[1], 0.5 * scenes[1].state.velocity)
    with pytest.raises(SweepFileError, match="member 1: state.velocity has other values"):
        sweep([scenes[0], other, scenes[2]], path)
    slower = [eqx.tree_at(lambda s: s.effects[2].viscosity, scene, 0.5) for scene in scenes]
    with pytest.raises(SweepFileError, match=r"member 0: effects\[2\].viscosity is 0.01"):
        sweep(slower, path)
    with Lock(path), pytest.raises(TrajectoryFileError, match="is being written by this process"):
        sweep(scenes, path)


def test_the_command(tmp_path, capsys):
    path = tmp_path / "sweep.h5"
    command = ["sweep", "taylor-green", "--resolution", "12", "--t-end", "0.04", "--arrangement",
               "jittered", "--reynolds", "100", "200:300:2", "--seed", "0", "1"]  # fmt: skip
    assert main([*command, "--out", str(path)]) == 0
    assert "6, 0 lost" in capsys.readouterr().out
    found = [(p["reynolds"], p["arrangement"]["seed"]) for p in read_status(path).parameters]
    assert found == [(r, s) for r in (100.0, 200.0, 300.0) for s in (0, 1)]
    assert main([*command, "7", "--out", str(path)]) == 2
    assert "holds another sweep" in capsys.readouterr().err
