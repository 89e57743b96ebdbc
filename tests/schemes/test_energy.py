"""The consistent scheme makes no energy: by identity, by eigenvalues, and in runs."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import BoxRegion, ParticleState, run_scene
from jaxsph.effects import AdjointPressure, FreeSlip, Gravity, KernelCorrection, LocalNoSlip
from jaxsph.kernels import QuinticSpline, WendlandC4
from jaxsph.schemes import DeltaPlus

from .vessels import SOUND, disturbed, rates_of, vessel

CORNERED = BoxRegion((0.0, 0.0), (14.0, 7.0)) | BoxRegion((0.0, 0.0), (7.0, 14.0))


def with_pressure_alone(scene):
    slip = (effect for effect in scene.effects if isinstance(effect, LocalNoSlip))
    return dataclasses.replace(scene, effects=(KernelCorrection(), AdjointPressure(), *slip))


def energy_rate(scene, state):
    """d/dt sum_i m (|u|^2 / 2 + e(rho)), de = p / rho^2 drho, over the sum of its parts' sizes."""
    found = rates_of(scene)(state)
    pressure = scene.fluid.pressure(state.density)
    kinetic = (state.velocity * found.velocity).sum(axis=1)
    acoustic = pressure / state.density**2 * found.density
    return float(kinetic.sum() + acoustic.sum()) / float(
        jnp.abs(kinetic).sum() + jnp.abs(acoustic).sum()
    )


@pytest.mark.parametrize(
    "options",
    [
        dict(side=12, periodic=True),
        dict(side=9),
        dict(side=9, jitter=0.0),
        dict(side=14, region=CORNERED),
        dict(side=9, h_over_dx=1.5),
        pytest.param(dict(side=12, h_over_dx=4.0), marks=pytest.mark.slow),
        pytest.param(dict(side=9, kernel=WendlandC4()), marks=pytest.mark.slow),
        pytest.param(dict(side=11, kernel=QuinticSpline()), marks=pytest.mark.slow),
        dict(side=6, dim=3),
        pytest.param(dict(side=11, dim=3, periodic=True), marks=pytest.mark.slow),
    ],
    ids=str,
)
@pytest.mark.run_once
def test_pressure_and_continuity_only_exchange_energy(options):
    scene = with_pressure_alone(vessel(**options))
    assert abs(energy_rate(scene, disturbed(scene))) < 1e-13  # round-off


def test_the_paper_s_scheme_does_not():
    scene = vessel(9, scheme=DeltaPlus())
    kept = (*scene.effects[:2], *scene.effects[-3:-1])  # continuity, pressure, ghosts
    assert abs(energy_rate(dataclasses.replace(scene, effects=kept), disturbed(scene))) > 1e-3


def test_in_single_precision_energy_is_kept_to_single_round_off():
    scene = with_pressure_alone(vessel(9, dtype=jnp.float32))
    assert abs(energy_rate(scene, disturbed(scene))) < 1e-6


def eigenvalues(scene):
    """[1/s], of the rates of velocity and density about rest, positions held."""
    count, dim = scene.state.position.shape
    rates = rates_of(scene)

    def change(values):
        velocity, density = values[: count * dim], values[count * dim :]
        state = ParticleState(scene.state.position, velocity.reshape(count, dim), density)
        found = rates(state)
        return jnp.concatenate([found.velocity.ravel(), found.density])

    rest = jnp.concatenate([jnp.zeros(count * dim), jnp.ones(count)])
    return np.linalg.eigvals(np.asarray(jax.jacfwd(change)(rest)))


def growth(scene):
    """Largest real part among these [c0 / dx]."""
    return eigenvalues(scene).real.max() / SOUND


@pytest.mark.parametrize(
    "options",
    [
        dict(side=12, periodic=True),
        pytest.param(dict(side=8, jitter=0.0), marks=pytest.mark.slow),
        dict(side=8),
        pytest.param(dict(side=8, jitter=0.4), marks=pytest.mark.slow),
        pytest.param(dict(side=8, h_over_dx=1.5), marks=pytest.mark.slow),
        pytest.param(dict(side=10, h_over_dx=3.0), marks=pytest.mark.slow),
        pytest.param(dict(side=14, region=CORNERED), marks=pytest.mark.slow),
        dict(side=8, viscosity=0.1),
        pytest.param(dict(side=5, dim=3), marks=pytest.mark.slow),
    ],
    ids=str,
)
def test_nothing_grows_about_rest(options):
    assert growth(vessel(**options)) < 1e-6


def test_what_the_paper_s_scheme_has_there():
    assert growth(vessel(8, jitter=0.0, scheme=DeltaPlus())) > 1e-2  # corners


@pytest.mark.parametrize(
    "options",
    [pytest.param(dict(side=10), marks=pytest.mark.slow), dict(side=12, periodic=True)],
    ids=str,
)
def test_disordered_particles_at_rest_stay_there(options):
    run = run_scene(vessel(viscosity=1e-6, end_time=20.0, **options))
    assert not np.any(run.velocity)
    np.testing.assert_array_equal(run.position[-1], run.position[0])


@pytest.mark.parametrize(
    "options",
    [
        dict(side=10),
        pytest.param(dict(side=12, periodic=True), marks=pytest.mark.slow),
        pytest.param(dict(side=5, dim=3), marks=pytest.mark.slow),
    ],
    ids=str,
)
def test_a_kick_s_energy_is_never_above_its_start(options):
    scene = vessel(viscosity=1e-6, end_time=40.0, **options)
    start = disturbed(scene, speed=0.02, density=0.0)
    run = run_scene(dataclasses.replace(scene, state=start))
    kinetic = 0.5 * (run.velocity**2).sum(axis=(1, 2))
    acoustic = 0.5 * SOUND**2 * ((run.density - 1.0) ** 2).sum(axis=1)
    energy = kinetic + acoustic
    assert energy.max() == energy[0]
    assert np.all(energy[5:] < 0.9 * energy[0])  # sound has gone


@pytest.mark.parametrize("dim", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_water_in_its_own_balance_stays_there(dim):
    """p of the fluid at rest under gravity, however disordered: no acceleration at all."""
    pull = jnp.zeros(dim).at[dim - 1].set(-1.0).at[0].set(0.3)
    scene = vessel(8 if dim == 2 else 5, dim, force=Gravity(pull))
    rest = scene.fluid.density_of_enthalpy(0.7 + scene.state.position @ pull)
    found = rates_of(scene)(ParticleState(scene.state.position, 0.0 * scene.state.position, rest))
    assert float(jnp.abs(found.velocity).max()) < 1e-12
    assert float(jnp.abs(found.density).max()) < 1e-2 * SOUND  # of the diffusion


def test_free_slip_walls_too():
    scene = vessel(8)
    slipping = (*scene.effects[:-2], FreeSlip(), scene.effects[-1])
    assert growth(dataclasses.replace(scene, effects=slipping)) < 1e-6


@pytest.mark.parametrize(
    "options",
    [
        dict(side=12, periodic=True),
        dict(side=8, viscosity=30.0),
        pytest.param(dict(side=12, periodic=True, jitter=0.4), marks=pytest.mark.slow),
        pytest.param(dict(side=12, periodic=True, viscosity=30.0), marks=pytest.mark.slow),
        pytest.param(dict(side=8, h_over_dx=1.5, viscosity=30.0), marks=pytest.mark.slow),
        pytest.param(dict(side=8, h_over_dx=1.5), marks=pytest.mark.slow),
        pytest.param(dict(side=16, h_over_dx=3.0, periodic=True), marks=pytest.mark.slow),
        pytest.param(dict(side=5, dim=3), marks=pytest.mark.slow),
    ],
    ids=str,
)
def test_the_longest_step_is_stable(options):
    """|R(lambda dt)| of Runge and Kutta's polynomial at the step limit, for every eigenvalue."""
    scene = vessel(**options)
    z = eigenvalues(scene) * scene.stable_time_step
    factor = 1.0 + z + z**2 / 2.0 + z**3 / 6.0 + z**4 / 24.0
    assert np.abs(factor).max() <= 1.0 + 1e-9
