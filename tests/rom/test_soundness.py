"""Runs that came to their end and are not to be believed."""

import dataclasses

import numpy as np
import pytest

from jaxsph import run_scene
from jaxsph.arrangements import Lattice
from jaxsph.scenes import taylor_green
from jaxsph_rom.study import doubt, level_and_fluctuation


@pytest.fixture(scope="module")
def made():
    scene = taylor_green(12, arrangement=Lattice(), end_time=0.05)
    return scene, run_scene(scene)


def test_level_and_fluctuation_are_apart():
    places = np.linspace(0.0, 1.0, 5)[None]
    wave = np.array([[1.0, -1.0, 0.0, -1.0, 1.0]])
    level, rest = level_and_fluctuation(places, places + 3.0 + 0.1 * wave)
    np.testing.assert_allclose(level, 300.0)
    np.testing.assert_allclose(rest, 8.0)  # the mean of 0.1 |wave|
    level, rest = level_and_fluctuation(0.0 * places, 0.0 * places + 1.0)
    assert np.isinf(level[0]) and rest[0] == 0.0


def test_what_is_wrong_first_is_named(made):
    scene, run = made
    good = np.full(len(run.time), 3.0)
    assert doubt(run, scene, run.time, good) is None
    off = np.where(run.time > run.time[1], 140.0, good)
    named = f"pressure is off by 140 % at t = {run.time[2]:.4g} s"
    assert doubt(run, scene, run.time, off) == named
    assert "nan" in doubt(run, scene, run.time, np.nan * good)
    assert doubt(run, scene, run.time[:1], off[:1]) is None  # later times do not count
    position = np.array(run.position)
    position[-1, 1] = position[-1, 0] + 1e-4
    clumped = dataclasses.replace(run, position=position)
    assert "particles clump from t = 0.05" in doubt(clumped, scene, run.time, good)
