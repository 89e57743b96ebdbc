"""Automatic steps: as long as the limits allow, the same flow, and a word where they run out."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import Schedule, SimulationError, run_scene, simulate
from jaxsph.arrangements import Lattice
from jaxsph.effects import SurfaceTension
from jaxsph.integrate import AutomaticSteps, FaultCode, FixedSteps, integrate
from jaxsph.scenes import dam_break, oscillating_drop, taylor_green

CFL = 1.5


@pytest.fixture(scope="module")
def scene():
    return taylor_green(16, arrangement=Lattice(), end_time=0.1)


def run(scene, stepping):
    return simulate(scene.model(), scene.state, scene.schedule, stepping=stepping)


def test_where_the_limits_allow_dt_the_steps_are_those_of_dt(scene):
    fixed, automatic = run(scene, FixedSteps()), run(scene, AutomaticSteps())
    np.testing.assert_array_equal(automatic.time, fixed.time)
    np.testing.assert_allclose(automatic.velocity, fixed.velocity, atol=1e-14)


def test_where_they_allow_more_the_steps_are_longer_and_the_flow_the_same(scene):
    fine = taylor_green(16, arrangement=Lattice(), time_step=scene.time_step / 4, end_time=0.1)
    fine = dataclasses.replace(fine, steps_per_snapshot=8)
    fixed, automatic = run(fine, FixedSteps()), run(fine, AutomaticSteps(most=1))
    np.testing.assert_array_equal(automatic.time, fixed.time)
    apart = np.abs(automatic.velocity[-1] - fixed.velocity[-1]).max()
    assert 0.0 < apart < 2e-3  # of steps four times as long; that of the spacing is 5e-2


def test_a_step_limit_is_the_least_of_sound_viscosity_and_force(scene):
    model = scene.model()
    h, c0 = scene.space.smoothing_length, 10.0
    speed = float(jnp.linalg.norm(scene.state.velocity, axis=1).max())
    none = jnp.zeros(())
    assert float(model.step_limit(scene.state, none)) == pytest.approx(CFL * h / (c0 + speed))
    fast = eqx.tree_at(lambda s: s.velocity, scene.state, scene.state.velocity.at[0, 0].set(5.0))
    assert float(model.step_limit(fast, none)) == pytest.approx(
        0.4 * model.search.skin / np.hypot(5.0, float(scene.state.velocity[0, 1]))
    )  # it would outrun the list
    forced = float(model.step_limit(scene.state, jnp.asarray(1e6)))
    assert forced == pytest.approx(0.25 * (h / 1e6) ** 0.5)
    thick = taylor_green(16, reynolds=1.0, time_step=1e-3, arrangement=Lattice())
    found = float(thick.model().step_limit(thick.state, none))
    assert found == pytest.approx(0.125 * h**2)
    assert thick.stable_time_step == pytest.approx(0.125 * h**2)


def test_surface_tension_limits_the_step():
    scene = oscillating_drop(24)
    tension = next(e for e in scene.effects if isinstance(e, SurfaceTension))
    wave = (scene.space.smoothing_length**3 / (2.0 * np.pi)) ** 0.5
    assert float(tension.step_limit(scene.fluid, scene.space)) == pytest.approx(wave)


def test_intervals_that_do_not_end_are_named(scene):
    model = eqx.tree_at(lambda m: m.functional.fluid.sound_speed, scene.model(), 1e3)
    with pytest.raises(SimulationError, match="automatic steps became so short"):
        simulate(
            model,
            scene.state,
            Schedule(scene.time_step, 2, 1),
            stepping=AutomaticSteps(most=2),
        )


def test_a_broken_state_is_named_not_stepped_over(scene):
    broken = eqx.tree_at(lambda s: s.density, scene.state, scene.state.density.at[3].set(5e3))
    with pytest.raises(SimulationError) as error:
        four = Schedule(scene.time_step, 4, 1)
        simulate(scene.model(), broken, four, stepping=AutomaticSteps())
    assert error.value.code in (FaultCode.DENSITY_OUT_OF_BOUNDS, FaultCode.NOT_FINITE)


@pytest.mark.run_once
def test_automatic_steps_have_a_reverse_mode(scene):
    """The gradient in the viscosity against central differences; the limits carry no derivative."""
    model, dt = scene.model(), jnp.asarray(scene.time_step)

    def energy(viscosity):
        changed = eqx.tree_at(lambda m: m.functional.effects[2].viscosity, model, viscosity)
        start = jnp.zeros((), jnp.int32)
        state, _, _, _ = integrate(changed, scene.state, start, dt, 2, 2, AutomaticSteps(most=2))
        return jnp.sum(state.velocity**2)

    nu = jnp.asarray(0.01)
    slope = float(jax.jit(jax.grad(energy))(nu))
    step = 1e-5
    measured = jax.jit(energy)
    central = float(measured(nu + step) - measured(nu - step)) / (2.0 * step)
    # steps follow the speed and the acceleration, whose share in the slope is left out on purpose
    assert slope == pytest.approx(central, rel=1e-3)


def test_a_dam_breaks_with_automatic_steps():
    scene = dam_break(40, end_time=0.06)
    found = run_scene(scene, stepping=AutomaticSteps())
    fixed = run_scene(scene)
    front = found.position[-1, :, 0].max()
    assert front == pytest.approx(fixed.position[-1, :, 0].max(), rel=5e-3)


def test_most_must_be_positive():
    with pytest.raises(ValueError, match="most"):
        AutomaticSteps(most=0)
