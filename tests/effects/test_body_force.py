"""Body forces against their formulas."""

import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph.effects import Gravity, KickAndHold, MovingFrame


def test_the_kick_and_what_is_held_after_it():
    kick = KickAndHold(100.0, 400.0, 0.01, 0.001, (0.1, 0.0), (0.3, 0.1))
    inside = jnp.asarray([[0.2, 0.05]])

    def strength(time):
        return float(kick.acceleration(jnp.asarray(time), inside)[0, 0])

    for time in (0.0, 0.005, 0.01, 0.013, 0.02, 1.0):  # the paper's formula, with f = -t
        exact = 100.0 * (1.0 / (1.0 + np.exp(-400.0 * (0.01 - time))) + 0.001)
        assert strength(time) == pytest.approx(exact, rel=1e-12)  # round-off
    assert strength(0.0) == pytest.approx(98.3, abs=0.02)
    assert strength(0.01) == pytest.approx(50.1, rel=1e-12)  # half of it
    assert strength(0.05) == pytest.approx(0.1, rel=2e-4)  # exp(-16) of 1000
    assert strength(1e6) == pytest.approx(0.1, rel=1e-12)


def test_the_kick_acts_in_its_box_only_and_along_the_first_axis():
    kick = KickAndHold(100.0, 400.0, 0.01, 0.001, (0.1, 0.0), (0.3, 0.1))
    x = jnp.asarray(np.random.default_rng(0).uniform([0.0, -0.1], [0.4, 0.1], (300, 2)))
    found = np.asarray(kick.acceleration(jnp.asarray(0.0), x))
    inside = np.asarray((x[:, 0] > 0.1) & (x[:, 0] < 0.3) & (x[:, 1] > 0.0))
    assert 30 < inside.sum() < 120
    np.testing.assert_array_equal(found[:, 1], 0.0)
    np.testing.assert_array_equal(found[~inside, 0], 0.0)
    assert np.all(found[inside, 0] > 98.0)
    single = kick.acceleration(jnp.asarray(0.0, jnp.float32), x.astype(jnp.float32))
    assert single.dtype == jnp.float32


def test_gravity_is_the_same_everywhere():
    b = jnp.asarray([0.5, -9.81, 0.0])
    found = Gravity(b).acceleration(jnp.asarray(3.0), jnp.ones((4, 3)))
    np.testing.assert_array_equal(found, np.broadcast_to(b, (4, 3)))


def test_the_inertia_of_a_moving_frame():
    """-d'' of d = (a t^3, b cos t)."""
    frame = MovingFrame(lambda t: jnp.stack([0.5 * t**3, 2.0 * jnp.cos(t)]))
    found = frame.acceleration(jnp.asarray(2.0), jnp.zeros((3, 2)))
    np.testing.assert_allclose(found, np.broadcast_to([-6.0, 2.0 * np.cos(2.0)], (3, 2)))
    double = MovingFrame(lambda t: np.array([0.5, 2.0]) * t.astype(float) ** 3)
    for each in (frame, double):
        single = each.acceleration(jnp.asarray(2.0, jnp.float32), jnp.zeros((3, 2), jnp.float32))
        assert single.dtype == jnp.float32
