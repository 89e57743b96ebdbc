"""A balanced start makes less sound."""

import numpy as np
import pytest

from jaxsph import run_scene
from jaxsph.arrangements import Stirred
from jaxsph.scenes import balanced, lid_driven_cavity, taylor_green


def amplitude(trajectory):
    """Of the vortices' own pressure at all times [Pa]."""
    wave = np.cos(4 * np.pi * trajectory.position).sum(axis=2)
    return (trajectory.pressure * wave).sum(axis=1) / (wave**2).sum(axis=1)


@pytest.mark.slow
def test_pressure_swings_less_from_a_balanced_start():
    scene = taylor_green(32, 100.0, arrangement=Stirred(), end_time=0.1)
    quiet = balanced(scene)
    np.testing.assert_array_equal(quiet.state.position, scene.state.position)
    np.testing.assert_array_equal(quiet.state.velocity, scene.state.velocity)
    np.testing.assert_allclose(quiet.state.density.mean(), scene.state.density.mean(), rtol=1e-12)
    apart = np.abs(np.asarray(quiet.state.density - scene.state.density)).max()
    assert 0.0 < apart < 0.5 * np.ptp(np.asarray(scene.state.density))  # a correction
    swings = []
    for each in (scene, quiet):
        found = amplitude(run_scene(each))
        decay = np.exp(-16 * np.pi**2 / 100.0 * each.time_step * each.steps_per_snapshot
                       * np.arange(len(found)))  # fmt: skip
        swings.append(np.ptp(found / decay))
    assert swings[1] < 0.6 * swings[0]


def test_walls_are_refused():
    with pytest.raises(ValueError, match="walls"):
        balanced(lid_driven_cavity(16))
