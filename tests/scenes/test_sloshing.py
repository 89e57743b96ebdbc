"""The shaken tank: linear theory by itself, and what a gauge sees beside it."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import run_scene
from jaxsph.integrate import integrate
from jaxsph.metrics import surface_height
from jaxsph.scenes import sloshing
from jaxsph.scenes.sloshing import (
    DEPTH,
    GRAVITY,
    LENGTH,
    Shaking,
    linear_elevation,
    natural_frequency,
)

AMPLITUDE = 0.003


def test_the_first_frequency_is_that_of_liu_and_lin():
    assert natural_frequency() == pytest.approx(6.0578, abs=1e-4)  # rad/s, their paper
    deep = GRAVITY * 9.0 * math.pi / LENGTH  # a short wave does not see the floor
    assert natural_frequency(9) == pytest.approx(math.sqrt(deep), rel=1e-3)


def test_a_tank_shaken_slowly_tilts_its_surface():
    """g d(eta)/dx = -b_x = d'': a plane, of which nine odd cosines leave 4 percent at the wall."""
    slow = 0.05
    rate = slow * natural_frequency()
    time = np.linspace(0.0, 2.5 * 2.0 * math.pi / rate, 26)
    wanted = 0.5 * LENGTH * AMPLITUDE * rate**2 * -np.sin(rate * time) / GRAVITY
    found = linear_elevation(0.0, time, AMPLITUDE, slow, viscosity=1e-3)
    late = time > 1.5 * 2.0 * math.pi / rate
    largest = np.abs(wanted).max()
    np.testing.assert_allclose(found[late], wanted[late], atol=0.06 * largest)
    middle = linear_elevation(0.5 * LENGTH, time, AMPLITUDE, slow)
    assert np.abs(middle).max() < 1e-6 * largest


def test_near_resonance_the_wave_of_linear_theory_grows_as_t():
    """q'' + w^2 q = c d'' at resonance: the amplitude of q is c A w t / 2, less what the ramp
    lacks; the other waves of the tank add some percent."""
    rate = natural_frequency()
    gain = 4.0 / math.pi * math.tanh(math.pi * DEPTH / LENGTH)
    periods = np.asarray([6.0, 7.0])
    time = np.linspace(0.0, periods[1], 1401) * 2.0 * math.pi / rate
    found = np.abs(linear_elevation(0.0, time, AMPLITUDE, 1.0))
    peaks = [found[(time * rate / (2.0 * math.pi) > p - 1.0)
                   & (time * rate / (2.0 * math.pi) <= p)].max() for p in periods]  # fmt: skip
    assert peaks[1] - peaks[0] == pytest.approx(gain * AMPLITUDE * math.pi, rel=0.05)


def test_the_tank_starts_without_a_jerk_and_then_swings():
    shaking = Shaking(AMPLITUDE, 5.0)
    period = 2.0 * math.pi / 5.0
    times = jnp.linspace(0.0, 3.0 * period, 601)
    acceleration = jax.vmap(jax.jacfwd(jax.jacfwd(lambda t: shaking(t)[0])))(times)
    assert float(acceleration[0]) == 0.0
    late = np.asarray(times) > period
    np.testing.assert_allclose(
        acceleration[late], -25.0 * AMPLITUDE * np.sin(5.0 * np.asarray(times)[late]), atol=1e-9
    )


@pytest.mark.slow  # half a minute; benchmarks.free_flows measures it too
def test_the_gauge_at_the_wall_sees_the_wave_of_linear_theory():
    """Ten particles deep, to the first two crests."""
    scene = sloshing(amplitude=AMPLITUDE, end_time=2.4)
    run = run_scene(scene, measure=None)
    height = surface_height(run, scene, 0.0)
    viscosity = math.sqrt(GRAVITY * DEPTH) * DEPTH / 1000.0
    wanted = linear_elevation(0.0, run.time, AMPLITUDE, 0.8, viscosity)
    off = height - np.mean(height - wanted) - wanted  # the level at rest is its own
    assert np.abs(height - DEPTH).mean() < 0.04 * DEPTH
    assert np.abs(off).max() < 0.25 * np.abs(wanted).max()
    far = surface_height(run, scene, LENGTH)
    np.testing.assert_allclose(far - far.mean(), height.mean() - height, atol=0.15 * wanted.max())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"amplitude": 0.05}, "amplitude: at most 0.03 m"),
        ({"amplitude": 0.0}, "amplitude: must be positive"),
        ({"frequency": -1.0}, "frequency: must be positive"),
        ({"reynolds": 0.0}, "reynolds: must be positive"),
    ],
)
def test_settings_out_of_range_are_named(options, message):
    with pytest.raises(ValueError, match=message):
        sloshing(**options)


def test_single_precision_is_kept():
    scene = sloshing(20, dtype=jnp.float32)
    model, dt = scene.model(), jnp.asarray(scene.time_step, jnp.float32)
    traced = jax.eval_shape(lambda s: integrate(model, s, np.int32(0), dt, 2, 1), scene.state)
    arrays = [*jax.tree.leaves(eqx.filter(scene, eqx.is_array)), *jax.tree.leaves(traced)]
    floats = {a.dtype for a in arrays if jnp.issubdtype(a.dtype, jnp.inexact)}
    assert floats == {jnp.dtype(jnp.float32)}
