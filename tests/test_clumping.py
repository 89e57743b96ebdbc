"""Pairs of particles that stick together are named."""

import dataclasses
import json

import jax.numpy as jnp
import numpy as np
import pytest

import jaxsph
from jaxsph import cli
from jaxsph.arrangements import Lattice
from jaxsph.clumping import Clumping, nearest


def stuck(scene, apart):
    """The scene with its first particle `apart` spacings from the second, and as fast."""
    position, velocity = scene.state.position, scene.state.velocity
    beside = position[1] - jnp.asarray([0.0, apart * scene.space.spacing])
    state = dataclasses.replace(
        scene.state,
        position=position.at[0].set(beside),
        velocity=velocity.at[0].set(velocity[1]),
    )
    return dataclasses.replace(scene, state=state)


@pytest.fixture(scope="module")
def scene():
    return jaxsph.scenes.taylor_green(12, end_time=0.03, arrangement=Lattice())


def test_the_nearest_pair_may_be_across_the_box(scene):
    box = scene.space.box
    position = np.array([[0.01, 0.5], [0.98, 0.5], [0.5, 0.5]])
    assert nearest(position, box) == pytest.approx(0.03)
    assert nearest(position + 1.0, box) == pytest.approx(0.03)
    walled = dataclasses.replace(box, periodic=(False, True))
    assert nearest(position, walled) == pytest.approx(0.48)
    assert nearest(position[:1], box) == np.inf
    below = position.copy()
    below[0, 0] = -1e-18  # round-off below the face: a whole length after it is wrapped
    assert nearest(below, box) == pytest.approx(0.02)


def test_a_run_names_a_pair_that_sticks_together_and_goes_on(scene):
    with pytest.warns(UserWarning, match=r"^t = 0 s: particles have clumped.* 0\.05 dx apart"):
        found = jaxsph.run_scene(stuck(scene, 0.05))
    assert found.time[-1] == pytest.approx(0.03) and found.metadata["doubt_time"] == 0.0
    assert "h/dx is 2" in found.metadata["doubt"]
    assert "doubt" not in jaxsph.run_scene(stuck(scene, 0.12)).metadata
    assert "doubt" not in jaxsph.run_scene(stuck(scene, 0.05), watch=None).metadata


def test_the_command_line_says_so_in_its_table_and_its_files(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(Clumping, "__call__", lambda self, time, _: "all is wrong")
    with pytest.warns(UserWarning, match="all is wrong"):
        size = ["--resolution", "12", "--arrangement", "lattice", "--t-end", "0.03"]
        told = ["--out", str(tmp_path), "--json", str(tmp_path / "r.json")]
        assert cli.main(["run", "taylor-green", *size, *told]) == 0
    assert "not to be believed" in capsys.readouterr().out
    assert json.loads((tmp_path / "r.json").read_text())["doubt"] == "all is wrong"
    assert "all is wrong" in (tmp_path / "report.html").read_text()
    kept = jaxsph.io.read_trajectory(tmp_path / "trajectory.h5")
    assert kept.metadata["doubt"] == "all is wrong"


@pytest.mark.run_once
def test_a_sweep_names_the_member(scene, tmp_path):
    both = [scene, stuck(scene, 0.0)]  # two at one place, as fast, stay together
    with pytest.warns(UserWarning, match=r"^member 1: particles have clumped") as warned:
        status = jaxsph.sweep(both, tmp_path / "sweep.h5")
    assert len(warned) == 1 and (status.code == 0).all()
