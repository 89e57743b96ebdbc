"""The floating box: its heave beside linear theory, its draught, and what ends it."""

import numpy as np
import pytest

from benchmarks.floating_box import CROSSINGS
from benchmarks.heaving import period
from benchmarks.references.heave import Tank
from jaxsph import SimulationError, run_scene
from jaxsph.scenes import floating_box
from jaxsph.scenes.floating_box import (
    DEPTH,
    GRAVITY,
    HEIGHT,
    LENGTH,
    REFERENCE_DENSITY,
    WIDTH,
    draught,
    water_level,
)


def test_archimedes():
    assert draught(500.0) == pytest.approx(0.5 * HEIGHT)
    assert draught(2000.0) == HEIGHT
    assert water_level(500.0, 0.0) == DEPTH
    # the box lifted out of the water: what it displaces at rest raises the level
    level = water_level(500.0, 0.2)
    assert LENGTH * level - WIDTH * draught(500.0) == pytest.approx(LENGTH * DEPTH)


def test_linear_theory_sloshes_and_converges():
    """With next to no box its first modes are those of a tank, w^2 = g k tanh k d."""
    tank = Tank(1.2, 0.5, 0.02, 0.01, 0.2, 1000.0, GRAVITY, 120)
    k = np.pi * np.arange(1, 4) / 1.2
    expected = np.sqrt(GRAVITY * k * np.tanh(0.5 * k))
    np.testing.assert_allclose(tank.modes[0][:3], expected, rtol=0.01)
    time = np.linspace(0.0, 2.0, 2001)
    tanks = (Tank(1.2, 0.5, 0.4, 0.1, 40.0, 1000.0, GRAVITY, n) for n in (60, 120))
    coarse, fine = (period(time, tank.heave(time, 0.02), CROSSINGS) for tank in tanks)
    assert fine == pytest.approx(coarse, rel=0.005)  # it converges; 0.23 percent measured


@pytest.mark.slow
def test_it_heaves_as_linear_theory_says():
    """Two periods, 20 dx wide and 5 dx deep in the water, against a potential flow in the same
    tank."""
    scene = floating_box(end_time=2.0)
    run = run_scene(scene, measure=None, averaged=None)
    height, level = run.bodies.position[:, 0, 1], water_level(500.0, 0.04)
    rest = level - draught(500.0) + 0.5 * HEIGHT
    tank = Tank(LENGTH, level, WIDTH, draught(500.0), float(scene.walls.free.parts[0].mass),
                REFERENCE_DENSITY, GRAVITY, 120)  # fmt: skip
    expected = period(run.time, tank.heave(run.time, height[0] - rest), CROSSINGS)
    # wanted is 5 percent; 0.65 below it measured
    assert period(run.time, height - rest, CROSSINGS) == pytest.approx(expected, rel=0.02)


@pytest.mark.slow
def test_it_rests_at_its_draught():
    scene = floating_box(lift=0.0, end_time=2.0)
    run = run_scene(scene, measure=None, averaged=None)
    late = run.time > 1.0
    sunk = DEPTH + 0.5 * HEIGHT - draught(500.0) - run.bodies.position[late, 0, 1]
    assert abs(sunk.mean()) < 0.1 * scene.space.spacing  # 0.01 of it measured
    assert np.abs(run.bodies.angle).max() < 0.01


@pytest.mark.slow
def test_what_sinks_ends_at_the_floor_with_a_name():
    scene = floating_box(density=3000.0, lift=0.0, end_time=2.0)
    with pytest.raises(SimulationError) as told:
        run_scene(scene, measure=None, averaged=None)
    assert "contact, which is not modelled: free body 0" in str(told.value)
    bottom = told.value.trajectory.bodies.position[:, 0, 1] - 0.5 * HEIGHT
    assert 0.0 < bottom[-1] < 3.0 * scene.space.spacing  # it is at the floor, and not beyond it


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"density": 0.0}, "density: must be positive"),
        ({"lift": 0.5}, "lift: 0.5 m puts the box"),
        ({"lift": -0.4}, "lift: -0.4 m puts the box"),
    ],
    ids=["no density", "too high", "too low"],
)
def test_what_cannot_be_is_refused(options, told):
    with pytest.raises(ValueError, match=told):
        floating_box(**options)
