"""A run that was killed goes on to the result of one that was not."""

import dataclasses
import json
import os
import subprocess
import sys
import time
from pathlib import Path

import equinox as eqx
import h5py
import numpy as np
import pytest

import jaxsph
from jaxsph.arrangements import JitteredLattice, Lattice
from jaxsph.cli import main
from jaxsph.cli import resume as resume_module
from jaxsph.io import TrajectoryFileError, TrajectoryWriter, read_checkpoint, read_trajectory
from jaxsph.kernels import WendlandC4
from jaxsph.metrics import kinetic_energy
from jaxsph.scenes import taylor_green
from jaxsph.scenes.record import scene_from_record

FIELDS = ("position", "velocity", "density", "pressure")
RUN = ["run", "taylor-green", "--resolution", "16", "--arrangement", "jittered", "--seed", "1"]


def run_and_kill(arguments, path, snapshots):
    """Start a run and kill it once it has stored some snapshots."""
    root = Path(jaxsph.__file__).parents[1]
    process = subprocess.Popen(
        [sys.executable, "-m", "jaxsph", *arguments],
        env={**os.environ, "PYTHONPATH": str(root)},
        stderr=subprocess.DEVNULL,
    )
    until = time.monotonic() + 120
    stored = -1
    while stored < snapshots and time.monotonic() < until and process.poll() is None:
        time.sleep(0.005)
        try:
            stored = len(read_trajectory(path).time)
        except TrajectoryFileError:  # not there yet
            continue
    process.kill()
    process.wait()


def test_killed_run_goes_on(tmp_path, capsys):
    killed, unbroken = tmp_path / "killed", tmp_path / "unbroken"
    path = killed / "trajectory.h5"
    run_and_kill([*RUN, "--out", str(killed)], path, snapshots=4)
    checkpoint = read_checkpoint(path)
    assert not checkpoint.complete
    assert 4 <= checkpoint.step < checkpoint.schedule.steps == 100
    before = read_trajectory(path)
    reports = [tmp_path / "resumed.json", tmp_path / "whole.json"]
    assert main(["run", "taylor-green", "--resume", str(path), "--json", str(reports[0])]) == 0
    assert main([*RUN, "--out", str(unbroken), "--json", str(reports[1])]) == 0
    errors = [json.loads(report.read_text())["errors"] for report in reports]
    assert errors[0] == pytest.approx(errors[1], rel=1e-6)  # against the same exact flow
    resumed, whole = read_trajectory(path), read_trajectory(unbroken / "trajectory.h5")
    np.testing.assert_array_equal(resumed.time, whole.time)
    for name in FIELDS:
        a, b = getattr(resumed, name), getattr(whole, name)
        count = len(before.time)
        np.testing.assert_array_equal(a[:count], getattr(before, name))
        # Equal to the last bit as a rule. But the list is allocated anew, and one of another size
        # may have its sums rounded otherwise: 1e-16 at first, more after the 90 steps that follow.
        assert np.max(np.abs(a - b)) <= 1e-11 * np.max(np.abs(b)), name
    assert resumed.metadata["parameters"] == whole.metadata["parameters"]
    capsys.readouterr()
    assert main(["run", "taylor-green", "--resume", str(path)]) == 0
    assert "is complete (100 steps to t = 1 s): nothing to do" in capsys.readouterr().out


def test_other_scene_is_refused(tmp_path, capsys):
    path = tmp_path / "t.h5"
    TrajectoryWriter.create(path, taylor_green(16, arrangement=Lattice())).close()
    assert main(["run", "taylor-green-3d", "--resume", str(path)]) == 2
    error = capsys.readouterr().err
    assert "holds a run of scene taylor-green, not of taylor-green-3d" in error
    assert error.count("\n") == 1


def test_killed_before_the_first_and_after_the_last_snapshot(tmp_path, capsys):
    scene = taylor_green(16, arrangement=Lattice(), end_time=0.04)
    with TrajectoryWriter.create(tmp_path / "last.h5", scene) as writer:
        made = jaxsph.run_scene(scene, recorder=writer)
    assert main(["run", "taylor-green", "--resume", str(tmp_path / "last.h5")]) == 0
    assert read_checkpoint(tmp_path / "last.h5").complete
    TrajectoryWriter.create(tmp_path / "first.h5", scene).close()
    assert main(["run", "taylor-green", "--resume", str(tmp_path / "first.h5")]) == 0
    read = read_trajectory(tmp_path / "first.h5")
    np.testing.assert_array_equal(read.velocity, made.velocity)


def test_scene_that_has_changed_since_is_refused(tmp_path, capsys):
    scene = taylor_green(16, arrangement=Lattice())
    path = tmp_path / "t.h5"
    TrajectoryWriter.create(path, scene).close()
    with h5py.File(path, "r+") as file:
        file.attrs["steps_per_snapshot"] = 7
    assert main(["run", "taylor-green", "--resume", str(path)]) == 2
    assert "now has other steps or particles" in capsys.readouterr().err


def test_scene_from_record():
    scene = taylor_green(
        20, 40.0, h_over_dx=1.7, arrangement=JitteredLattice(0.1, 5), kernel=WendlandC4(),
        dtype="float32",
    )  # fmt: skip
    again = scene_from_record(scene.name, scene.parameters)
    assert again.parameters == scene.parameters
    assert (again.space, again.time_step, again.steps) == (
        scene.space,
        scene.time_step,
        scene.steps,
    )
    np.testing.assert_array_equal(again.state.position, scene.state.position)
    assert again.state.density.dtype == scene.state.density.dtype
    spared = scene_from_record(scene.name, scene.parameters, Lattice())
    assert spared.parameters == scene.parameters


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"kernel": "Gaussian"}, "kernel: 'Gaussian' is not known; choose one of .*WendlandC2"),
        ({"kernel": "Kernel"}, "kernel: 'Kernel' is not known"),
        ({"arrangement": {"rule": "Hexagons"}}, "arrangement: 'Hexagons' is not known"),
        ({"arrangement": {"rule": "Lattice", "angle": 3}}, "angle"),
        ({"gravity": 9.81}, "scene taylor-green has no gravity"),
    ],
)
def test_unknown_record(change, message):
    scene = taylor_green(16, arrangement=Lattice())
    with pytest.raises(ValueError, match=message):
        scene_from_record(scene.name, {**scene.parameters, **change})
    with pytest.raises(ValueError, match="scene: 'x' is not known"):
        scene_from_record("x", scene.parameters)


def edited(scene):
    """Three times as viscous."""
    return eqx.tree_at(lambda s: s.effects[2].viscosity, scene, 3 * scene.effects[2].viscosity)


class Cut(Exception):
    """What stops a run."""


def cut_after(snapshots):
    def report(steps):
        nonlocal snapshots
        snapshots -= 1
        if not snapshots:
            raise Cut

    return report


def test_an_edited_scene_goes_on_as_it_is_or_not_at_all(tmp_path, capsys):
    scene = edited(taylor_green(16, arrangement=Lattice(), end_time=0.16))
    path = tmp_path / "t.h5"
    with pytest.raises(Cut):
        jaxsph.run_scene(scene, path, progress=cut_after(3))
    before = path.read_bytes()
    assert main(["run", "taylor-green", "--resume", str(path)]) == 2
    error = capsys.readouterr().err
    assert "effects[2].viscosity is 0.03 (float64) there and 0.01 (float64) here" in error
    assert error.count("\n") == 1
    with pytest.raises(TrajectoryFileError, match="holds another run .effects"):
        jaxsph.run_scene(taylor_green(16, arrangement=Lattice(), end_time=0.16), path)
    assert path.read_bytes() == before
    done = []
    found, wanted = jaxsph.run_scene(scene, path, progress=done.append), jaxsph.run_scene(scene)
    assert sum(done) == scene.steps - 6
    energy = [kinetic_energy(run.velocity[-1], 1.0) for run in (found, wanted)]
    np.testing.assert_allclose(*energy, rtol=1e-12)
    assert jaxsph.run_scene(scene, path, progress=done.append).time[-1] == wanted.time[-1]
    assert sum(done) == scene.steps - 6  # it was read


def test_a_finished_run_goes_on_to_a_later_end(tmp_path, capsys):
    run = ["run", "taylor-green", "--resolution", "16", "--arrangement", "jittered", "--t-end"]
    path = tmp_path / "short" / "trajectory.h5"
    assert main([*run, "0.08", "--out", str(path.parent)]) == 0
    assert main([*run, "0.12", "--out", str(tmp_path / "long")]) == 0
    resume = ["run", "taylor-green", "--resume", str(path), "--t-end"]
    between = "lies between snapshots, which the run has every 0.02 s; give 0.1 or 0.12"
    for end, message in (("0.06", "run has come to t = 0.08 s"), ("0.095", between)):
        capsys.readouterr()
        assert main([*resume, end]) == 2
        assert message in capsys.readouterr().err
    kept = read_checkpoint(path)
    odd = dataclasses.replace(kept, schedule=dataclasses.replace(kept.schedule, time_step=1 / 300))
    assert resume_module._end(1.00667, odd) == pytest.approx(151 / 150, rel=1e-12)  # as advised
    branch = ["--from-step", "8", "--out", str(tmp_path / "branch")]
    assert main([*resume, "0.12", *branch]) == 0
    assert main([*resume, "0.12"]) == 0
    wanted = read_trajectory(tmp_path / "long" / "trajectory.h5")
    for name in (path, tmp_path / "branch" / "trajectory.h5"):
        found = read_trajectory(name)
        for field in FIELDS:
            a, b = getattr(found, field), getattr(wanted, field)
            assert np.max(np.abs(a - b)) <= 1e-12 * np.max(np.abs(b)), field
        assert found.metadata["parameters"] == wanted.metadata["parameters"]
        kept, like = read_checkpoint(name), read_checkpoint(tmp_path / "long" / "trajectory.h5")
        assert (kept.schedule.steps, kept.complete, kept.content) == (12, True, like.content)
