"""Steps of a run: whole intervals, times, and what is refused."""

import dataclasses

import numpy as np
import pytest

from jaxsph import Schedule, simulate
from jaxsph.arrangements import Lattice
from jaxsph.scenes import taylor_green


def test_intervals_come_nearest_to_an_end():
    schedule = Schedule.until(1.0, 0.01, 7)  # 14.3 intervals
    assert (schedule.intervals, schedule.steps) == (14, 98)
    assert schedule.interval == pytest.approx(0.07) and schedule.end_time == pytest.approx(0.98)
    np.testing.assert_allclose(schedule.times, np.linspace(0.0, 0.98, 15), atol=1e-15)
    assert Schedule.until(1e-9, 0.01, 7).intervals == 1


@pytest.mark.parametrize(
    "each, intervals, named", [(0, 1, "steps_per_snapshot"), (1, -1, "intervals")]
)
def test_no_steps_are_refused(each, intervals, named):
    with pytest.raises(ValueError, match=f"^{named}.*at least"):
        Schedule(0.1, each, intervals)


@pytest.mark.parametrize("step", [0.0, -0.1, float("nan"), float("inf")])
def test_a_step_that_is_none_is_refused(step):
    with pytest.raises(ValueError, match="time_step: above zero and finite"):
        Schedule(step, 1, 1)


def test_a_scene_runs_by_its_own_schedule():
    scene = taylor_green(16, arrangement=Lattice(), end_time=0.1)
    schedule = scene.schedule
    assert schedule == Schedule(scene.time_step, scene.steps_per_snapshot, schedule.intervals)
    assert schedule.steps == scene.steps and schedule.end_time == pytest.approx(0.1)
    for first_step in (1, schedule.steps):  # within an interval, and with none left
        with pytest.raises(ValueError, match="first_step.*whole, positive"):
            simulate(scene.model(), scene.state, schedule, first_step=first_step)
    with pytest.raises(ValueError, match="steps_per_snapshot: at least 1"):
        dataclasses.replace(scene, steps_per_snapshot=0)
