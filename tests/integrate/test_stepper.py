"""A model of rates alone, by steps of the library's and of one's own."""

import dataclasses
from functools import partial
from typing import final

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array

from jaxsph import simulate
from jaxsph.arrangements import Lattice
from jaxsph.content import digest
from jaxsph.integrate import AutomaticSteps, FaultCode, FixedSteps, Model, Stepper, integrate
from jaxsph.scenes import taylor_green


@final
class Heun(Stepper):
    """Second order, in two stages."""

    def step(self, rates, time, state, time_step):
        first = rates(time, state)
        ahead = jax.tree.map(lambda y, k: y + time_step * k, state, first)
        second = rates(time + time_step, ahead)
        return jax.tree.map(lambda y, a, b: y + 0.5 * time_step * (a + b), state, first, second)


class Drawn(Model):
    """dx/dt = -k (x - cos t); its exact end from x = 1/2 is `exact`."""

    rate: Array

    def rates(self, time, state, auxiliary):
        return {"x": -self.rate * (state["x"] - jnp.cos(time))}


def exact(k, t):
    slow = k * (k * np.cos(t) + np.sin(t)) / (1.0 + k**2)
    return slow + (0.5 - k**2 / (1.0 + k**2)) * np.exp(-k * t)


@partial(jax.jit, static_argnums=(2, 3))
def run(model, time_step, steps, stepping):
    return integrate(model, {"x": jnp.asarray([0.5])}, 0, time_step, steps, 1, stepping)


@pytest.mark.parametrize(
    "stepping, order", [(FixedSteps(), 4), (FixedSteps(stepper=Heun()), 2)], ids=["RK4", "Heun"]
)
def test_the_order_is_the_steppers(stepping, order):
    steps, errors = np.asarray([20, 40, 80]), []
    for n in steps:
        state, fault, observed, good = run(Drawn(jnp.asarray(1.5)), 2.0 / n, int(n), stepping)
        assert int(fault.code) == FaultCode.NONE and bool(good[0])
        np.testing.assert_array_equal(observed["x"][0], state["x"])
        errors.append(abs(float(state["x"][0]) - exact(1.5, 2.0)))
    slope = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert slope == pytest.approx(order, abs=0.1)  # dt up to 0.1: the next order bends it a little


def test_a_value_that_is_not_finite_ends_a_run_of_rates_alone():
    model = Drawn(jnp.asarray(1e200))  # x overflows in the second step
    state, fault, _, good = run(model, jnp.asarray(0.1), 5, FixedSteps(stepper=Heun()))
    assert (int(fault.code), int(fault.step)) == (FaultCode.NOT_FINITE, 1)
    assert float(state["x"][0]) == 0.5 and not bool(good[0])


def velocity(scene, stepping):
    """After the first interval between snapshots."""
    first = dataclasses.replace(scene.schedule, intervals=1)
    return simulate(scene.model(), scene.state, first, stepping=stepping).velocity[-1]


def test_the_full_model_takes_it_in_both_kinds_of_steps():
    scene = taylor_green(16, arrangement=Lattice(), end_time=0.1)
    own = velocity(scene, FixedSteps(stepper=Heun()))
    automatic = velocity(scene, AutomaticSteps(stepper=Heun()))  # the limits allow dt here
    np.testing.assert_allclose(automatic, own, atol=1e-13)
    fine = dataclasses.replace(
        taylor_green(16, arrangement=Lattice(), end_time=0.1, time_step=scene.time_step / 4),
        steps_per_snapshot=4 * scene.steps_per_snapshot,
    )
    apart = np.abs(own - velocity(scene, FixedSteps())).max()
    nearer = velocity(fine, FixedSteps(stepper=Heun())) - velocity(fine, FixedSteps())
    assert 0.0 < np.abs(nearer).max() < apart / 4.0  # first order at least


def test_runs_by_other_steppers_are_told_apart():
    assert digest(FixedSteps()) != digest(FixedSteps(stepper=Heun()))
    assert digest(FixedSteps()) == digest(FixedSteps())
