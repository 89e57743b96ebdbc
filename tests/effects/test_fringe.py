"""A fringe takes the place of all other accelerations, inside it and there alone."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph.arrangements import Lattice
from jaxsph.effects import Fringe, ParabolicProfile
from jaxsph.effects.fringe import Varying, held
from jaxsph.scenes import poiseuille_open

TIME = jnp.zeros(())


@pytest.fixture(scope="module")
def scene():
    return poiseuille_open(12, h_over_dx=1.5, arrangement=Lattice())


def rates(scene, peak=1.0):
    (fringe,) = (e for e in scene.effects if isinstance(e, Fringe))
    fringe = dataclasses.replace(fringe, profile=ParabolicProfile(jnp.asarray(peak), 1.0))
    model = scene.model().with_effect(fringe)
    return model.rates(TIME, scene.state, model.prepare(scene.state)).velocity


def test_fringe_governs_its_second_half_and_leaves_the_channel_alone(scene):
    (fringe,) = (e for e in scene.effects if isinstance(e, Fringe))
    others = tuple(e for e in scene.effects if e is not fringe)
    free = dataclasses.replace(scene, effects=others, solution=None).model()
    alone = free.rates(TIME, scene.state, free.prepare(scene.state)).velocity
    found, x = rates(scene), np.asarray(scene.state.position[:, 0])
    channel, held = x < fringe.start, x > 0.5 * (fringe.start + fringe.end)
    assert channel.any() and held.any()
    np.testing.assert_array_equal(found[channel], alone[channel])
    excess = scene.state.velocity - fringe.profile(scene.state.position, TIME)
    np.testing.assert_allclose(found[held], (-fringe.rate * excess)[held], rtol=1e-12, atol=1e-10)


def test_inflow_may_be_differentiated(scene):
    """The rates are linear in the inflow's peak."""

    def total(peak):
        return jnp.sum(rates(scene, peak)[:, 0])

    slope = float(jax.grad(total)(1.0))
    assert slope == pytest.approx(float(total(2.0) - total(1.0)), rel=1e-9)


def test_an_inflow_has_the_precision_of_the_particles():
    """Whatever its factor has."""
    steady = ParabolicProfile(jnp.asarray(2.0, jnp.float32), 1.0)
    inflow = Varying(steady, lambda t: np.array([[3.0]]) * t.astype(float))
    x, time = jnp.full((2, 2), 0.5, jnp.float32), jnp.asarray(2.0, jnp.float32)
    with jax.numpy_dtype_promotion("standard"):  # as users have it
        found = held(inflow, x, time)
    for each, wanted in zip(found, (12.0, 6.0), strict=True):
        assert each.dtype == jnp.float32
        np.testing.assert_allclose(each, [[wanted, 0.0]] * 2, rtol=1e-6)


def test_bad_fringe_is_refused():
    with pytest.raises(ValueError, match="must lie behind"):
        Fringe(ParabolicProfile(jnp.ones(()), 1.0), jnp.ones(()), 2.0, 1.0)
