"""What is learnt from runs of a known oscillator."""

from itertools import combinations_with_replacement

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from jaxsph.scenes import sloshing, standing_wave
from jaxsph.scenes.sloshing import GRAVITY, natural_frequency
from jaxsph_rom.labels import Inputs
from jaxsph_rom.labels.cubic_system import products
from jaxsph_rom.labels.learning import LabelRun, learn

INTERVAL, COUNT = 0.1, 401


def viscosities(*reynolds, dtype=None):
    scenes = [standing_wave(16, number, end_time=4.0, dtype=dtype) for number in reynolds]
    functionals = [scene.functional() for scene in scenes]
    place = scenes[0].state.position[0]
    return Inputs.between(functionals, place, 4.0)


def oscillator(amplitude, viscosity, noise=0.0):
    """x'' = -4 x (1 - x^2 / 10) - 20 nu x' from x = 0: its frequency falls with the amplitude."""

    def rates(t, y):
        return [y[1], -4.0 * y[0] * (1.0 - 0.1 * y[0] ** 2) - 20.0 * viscosity * y[1]]

    times = INTERVAL * np.arange(COUNT)
    found = solve_ivp(rates, (0.0, times[-1]), [0.0, amplitude], t_eval=times, rtol=1e-11,
                      atol=1e-12).y.T  # fmt: skip
    noisy = found + noise * np.random.default_rng(1).normal(size=found.shape)
    return LabelRun(np.asarray([viscosity]), found[0], noisy, found**2)


def test_products_are_all_up_to_the_third_degree():
    a, p = jnp.asarray([2.0, 3.0, 5.0]), jnp.asarray([7.0, 11.0])
    wanted = [
        float(np.prod([a[k] for k in chosen]))
        for degree in range(4)
        for chosen in combinations_with_replacement(range(3), degree)
    ]
    wanted += [float(q * b) for q in p for b in (*a, 1.0)]
    np.testing.assert_allclose(products(a, p), wanted)
    assert len(wanted) == 1 + 3 + 6 + 10 + 2 * 4


@pytest.fixture(scope="module")
def inputs():
    return viscosities(500.0, 1000.0)


def test_viscosity_is_an_input_in_its_own_size(inputs):
    assert inputs.count == 1 and inputs.axes == ()
    for reynolds, wanted in ((500.0, 1.0), (1000.0, -1.0), (2000.0 / 3.0, 0.0)):
        found = inputs(jnp.zeros(()), jnp.asarray([1.0 / reynolds]))
        np.testing.assert_allclose(found, [wanted], atol=1e-12)


def test_the_acceleration_of_a_shaken_tank_is_an_input_and_gravity_is_none():
    scenes = [sloshing(20, amplitude=a, end_time=3.0) for a in (0.002, 0.004)]
    functionals = [scene.functional() for scene in scenes]
    inputs = Inputs.between(functionals, scenes[0].state.position[0], 3.0)
    assert inputs.own == () and inputs.axes == (0,)  # the amplitude acts by the force alone
    rate = 0.8 * natural_frequency()
    time = jnp.asarray(2.3)  # the ramp is over after 1.3 s
    for amplitude in (0.002, 0.003):
        raw = inputs.raw(time, jnp.asarray([amplitude]))
        np.testing.assert_allclose(raw, [amplitude * rate**2 * np.sin(rate * 2.3)], rtol=1e-9)
    assert float(jnp.abs(inputs.size[0])) < 0.1 * GRAVITY


def test_a_nonlinear_damped_oscillator_is_learnt(inputs):
    """At an amplitude and a viscosity between those of the runs; exact up to differences in time
    and RK4, whose phase is off by some 1e-4 in 13 periods."""
    runs = [oscillator(a, v) for a in (0.6, 1.2) for v in (0.001, 0.002)]
    learnt = learn(runs, inputs, INTERVAL)
    assert learnt.after < 1e-4
    rolled = rollout(learnt.system, oscillator(0.9, 0.0014))
    wanted = oscillator(0.9, 0.0014).coordinates
    assert np.abs(rolled - wanted).max() < 2e-3 * np.abs(wanted).max()
    others = jax.vmap(lambda a: learnt.system.recovered(jnp.zeros(()), a, jnp.asarray([0.0014])))
    np.testing.assert_allclose(others(jnp.asarray(wanted)), wanted**2, atol=1e-3)


def test_fitting_the_runs_mends_what_noisy_rates_spoil(inputs):
    points = [(a, v) for a in (0.6, 1.2) for v in (0.001, 0.002)]
    runs, clean = ([oscillator(*p, noise=n) for p in points] for n in (0.01, 0.0))
    learnt = learn(runs, inputs, INTERVAL)
    shares = [
        np.sum((a.coordinates - b.coordinates) ** 2) / np.sum(a.coordinates**2)
        for a, b in zip(runs, clean, strict=True)
    ]
    floor = np.sqrt(np.mean(shares))  # the noise itself: 3 percent
    assert learnt.before > 1.3 * floor  # 4.3 percent measured
    assert learnt.after < 1.02 * floor
    rolled, wanted = (rollout(learnt.system, oscillator(0.9, 0.0014)),
                      oscillator(0.9, 0.0014).coordinates)  # fmt: skip
    assert np.abs(rolled - wanted).max() < 0.02 * np.abs(wanted).max()


def test_single_precision_is_kept():
    inputs = viscosities(500.0, 1000.0, dtype=jnp.float32)
    runs = [
        LabelRun(*(np.asarray(a, np.float32) for a in oscillator(a, v)))
        for a in (0.6, 1.2) for v in (0.001, 0.002)
    ]  # fmt: skip
    learnt = learn(runs, inputs, INTERVAL)
    system = learnt.system
    assert {a.dtype for a in (system.weights, system.recovery)} == {jnp.dtype(jnp.float32)}
    assert learnt.after < 1e-3


def test_too_few_snapshots_are_named(inputs):
    run = oscillator(0.6, 0.001)
    short = run._replace(coordinates=run.coordinates[:10], others=run.others[:10])
    with pytest.raises(ValueError, match="10 snapshots; rates need 11"):
        learn([short], inputs, INTERVAL)


def rollout(system, run):
    found = solve_ivp(
        jax.jit(lambda t, a: system.rates(t, a, jnp.asarray(run.values))),
        (0.0, INTERVAL * (COUNT - 1)), run.start, t_eval=INTERVAL * np.arange(COUNT), rtol=1e-9,
        atol=1e-10,
    )  # fmt: skip
    return found.y.T
