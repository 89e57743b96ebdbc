"""`jaxsph-rom train my_family.py --train NAME=VALUE,VALUE`: a reduced model of one's own scenes."""

import json
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

from jaxsph.io import read_trajectory
from jaxsph_rom import load
from jaxsph_rom.cli import main

FAMILY = '''
import jax.numpy as jnp

import jaxsph
from jaxsph.effects import Gravity
from jaxsph.scenes import Scale, composed
from jaxsph.schemes import Consistent

WAVE = 2.0 * jnp.pi


def _vortices(x):
    a, b = WAVE * x[:, 0], WAVE * x[:, 1]
    return 0.2 * jnp.stack([jnp.cos(a) * jnp.sin(b), -jnp.sin(a) * jnp.cos(b)], axis=1)


def carried(viscosity: float, force: float, resolution: int = 12, end_time: float = 0.1):
    """Vortices that decay while a force carries them along."""
    return composed(
        "carried", effects=(*Consistent().effects(viscosity), Gravity([force, 0.0])),
        box=jaxsph.Box.unit_periodic(2), scale=Scale(resolution, 1.5, 5e-3, 4),
        end_time=end_time, reference_density=1.0, reference_speed=1.0, velocity=_vortices,
        parameters={"viscosity": viscosity, "force": force},
    )
'''
TRAIN = ["train", "my_family.py", "--train", "viscosity=0.01,0.02", "force=0.5,1", "--modes", "4",
         "--closure", "none"]  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A model of four runs, at all combinations of two viscosities and two forces."""
    folder = tmp_path_factory.mktemp("family")
    (folder / "my_family.py").write_text(FAMILY)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setattr(sys, "path", list(sys.path))
        assert main([*TRAIN, "--out", "own", "--json", "train.json"]) == 0
    return folder


def test_all_combinations_are_run_and_kept(folder, monkeypatch, capsys):
    told = json.loads((folder / "train.json").read_text())
    points = {(named["viscosity"], named["force"]) for named in told["trained_on"]}
    assert points == {(v, f) for v in (0.01, 0.02) for f in (0.5, 1.0)}
    runs = list((folder / "own" / "full").rglob("trajectory.h5"))
    assert len(runs) == 4
    for run in runs:
        of = read_trajectory(run).metadata["parameters"]
        points.remove((of["viscosity"], of["force"]))
    assert not points and load(folder / "own" / "model.h5").names == ("viscosity", "force")
    # what it leaves trains it again, and makes no run anew
    kept = tomllib.loads((folder / "own" / "run.toml").read_text())
    assert kept["train"] == ["viscosity=0.01,0.02", "force=0.5,1"]
    monkeypatch.chdir(folder)
    monkeypatch.setattr(sys, "path", list(sys.path))
    stamps = {run: run.stat().st_mtime_ns for run in runs}
    assert main(["train", "--config", "own/run.toml", "--out", "own"]) == 0
    assert {run: run.stat().st_mtime_ns for run in runs} == stamps
    assert "runs kept" in capsys.readouterr().out


def test_at_parameters_between_them_it_flows_as_the_equations_say(folder, monkeypatch):
    monkeypatch.chdir(folder)
    where = ["--at", "viscosity=0.015", "force=0.8"]
    assert main(["predict", "own/model.h5", *where, "--fields", "--out", "unseen"]) == 0
    fields = read_trajectory(Path("unseen/fields/member-000.h5"))
    drift = fields.velocity.mean(axis=1)
    # nothing but the force moves the whole: u = f t, exactly
    np.testing.assert_allclose(drift[:, 0], 0.8 * fields.time, atol=1e-3)
    np.testing.assert_allclose(drift[:, 1], 0.0, atol=1e-3)
    energy = ((fields.velocity - drift[:, None]) ** 2).sum(axis=(1, 2))
    exact = np.exp(-16.0 * np.pi**2 * 0.015 * fields.time)  # both components, twice 2 k^2 nu
    # h is an eighth of the wave's length; energy falls to four fifths
    np.testing.assert_allclose(energy / energy[0], exact, rtol=0.05)
    assert exact[-1] < 0.82


def test_a_parameter_that_is_missing_is_named(folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    monkeypatch.setattr(sys, "path", list(sys.path))
    for words, message in (
        (["train", "my_family.py", "--train", "viscosity=0.01,0.02", "--modes", "2"], "force"),
        (["train", "my_family.py", "--modes", "2"], "has no reynolds"),
        (["predict", "own/model.h5", "--at", "force=0.8"], "--at viscosity=... force=..."),
    ):
        assert main([*words, "--out", "refused"]) == 2
        error = capsys.readouterr().err
        assert error.count("\n") == 1 and message in error
    assert not Path("refused").exists()
