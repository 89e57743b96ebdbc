"""A channel that widens over a step."""

import numpy as np
import pytest

from benchmarks.backward_facing_step import passing, reattachment
from jaxsph import run_scene
from jaxsph.scenes import backward_facing_step
from jaxsph.scenes.backward_facing_step import REATTACHMENT
from jaxsph.scenes.record import scene_from_record

SHORT = {"upstream": 1.0, "downstream": 2.0, "h_over_dx": 1.3}


def test_fluid_fills_the_channels_and_a_parabola_flows_in():
    scene = backward_facing_step(8, end_time=0.1, **SHORT)
    x, y = np.asarray(scene.state.position).T
    below = y < 0.0
    assert x[below].min() > 1.0 and x[below].max() < 3.0  # the step, and where it narrows again
    area = 1.0 * (1.0 + 2.0 + 2.0) + 1.0 * 2.0  # narrow throughout, and the wide part's lower half
    assert len(x) == round(64 * area)
    along, across = np.asarray(scene.state.velocity).T
    np.testing.assert_allclose(along, np.where(below, 0.0, 6.0 * y * (1.0 - y)), atol=1e-12)
    assert not across.any()
    again = scene_from_record(scene.name, scene.parameters)
    np.testing.assert_array_equal(again.state.velocity, scene.state.velocity)


@pytest.mark.run_once
def test_a_short_run_keeps_the_inflow_and_the_density():
    scene = backward_facing_step(8, end_time=0.1, dtype="float32", **SHORT)
    trajectory = run_scene(scene)
    assert trajectory.velocity.dtype == np.float32
    assert np.abs(trajectory.density - 1.0).max() < 0.02
    x, y = trajectory.position[-1].T
    held = (x > 4.0) & (y > 0.25) & (y < 0.75)  # the fringe's second half
    np.testing.assert_allclose(
        trajectory.velocity[-1][held][:, 0], 6.0 * (y * (1.0 - y))[held], rtol=0.03
    )


@pytest.mark.slow
def test_the_flow_comes_back_to_the_wall_where_it_should():
    scene = backward_facing_step(10, 100.0, downstream=8.0)
    trajectory = run_scene(scene)
    late = trajectory.time > 0.75 * trajectory.time[-1]
    found = reattachment(scene, trajectory, late)
    assert found == pytest.approx(REATTACHMENT[100.0], rel=0.08)  # 0.071 measured at this size
    assert passing(scene, trajectory, late, 1.0) == pytest.approx(1.0, rel=0.01)


@pytest.mark.parametrize(
    "settings, message",
    [
        ({"reynolds": 0.0}, "reynolds: must be positive"),
        ({"downstream": 0.5}, "downstream: at least 1 m and finite"),
        ({"upstream": np.nan}, "upstream: at least 1 m and finite"),
    ],
)
def test_bad_settings_are_refused(settings, message):
    with pytest.raises(ValueError, match=message):
        backward_facing_step(**settings)
