"""Rates at samples: terms that are not polynomial, forces in time, the full loop."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import LinearEquationOfState
from jaxsph.arrangements import Lattice
from jaxsph.effects import KickAndHold
from jaxsph.integrate import FaultCode, integrate
from jaxsph.scenes import taylor_green
from jaxsph.scenes import taylor_green_solution as exact
from jaxsph_rom import Energy, pod
from jaxsph_rom.points import (
    QDEIM,
    EulerianRates,
    NonNegativeWeights,
    PointsModel,
    SampledRates,
    VisitedStates,
    rate_basis,
    to_log_density,
)

VISCOSITY = 0.01


class StiffGas(LinearEquationOfState):
    """p = c0^2 rho0 / 7 [(rho / rho0)^7 - 1], Tait's equation as weakly compressible SPH has it."""

    def pressure(self, density, reference_density, sound_speed):
        scale = sound_speed**2 * reference_density / 7.0
        return scale * ((density / reference_density) ** 7 - 1.0)


def projected(rates, basis, time, coordinates, viscosity):
    """Phi^T W f-bar over all points."""
    fields = jnp.asarray(basis.centre + basis.modes @ coordinates)
    found = eqx.filter_jit(rates)(jnp.asarray(time), fields, jnp.asarray(viscosity))
    return np.einsum("gfm,f,gf->m", basis.modes, basis.weights, found)


def smooth_basis(scene, modes, seed=0):
    """Smooth random modes."""
    x, rng = np.asarray(scene.state.position), np.random.default_rng(seed)
    wave = 2 * np.pi * rng.integers(1, 3, size=(3, 2, 2 * modes))
    phase = rng.uniform(0, 2 * np.pi, size=(3, 1, 2 * modes))
    fields = np.sin(np.einsum("gd,fdm->fgm", x, wave) + phase).transpose(1, 0, 2)
    rest = float(scene.fluid.reference_density)
    fields[:, 0] = rest * (1.0 + 0.02 * fields[:, 0])
    return pod(fields, Energy(), scene.fluid, modes)


@pytest.fixture(scope="module")
def kicked():
    """A stiff gas that is kicked: rates on all points, basis, and modes of its rates."""
    scene = taylor_green(16, 100.0, arrangement=Lattice())
    kick = KickAndHold(*map(jnp.asarray, (100.0, 400.0, 0.01, 0.001)), (0.3, 0.3), (0.7, 0.7))
    scene = eqx.tree_at(lambda s: s.fluid.equation_of_state, scene, StiffGas())
    scene = eqx.tree_at(
        lambda s: s.effects, scene, (*scene.effects, kick), is_leaf=lambda x: isinstance(x, tuple)
    )
    rates = EulerianRates.of_scene(scene, scene.state.position)
    basis = smooth_basis(scene, 3)
    times, rng = np.linspace(0.0, 0.03, 40), np.random.default_rng(0)
    visited = [VisitedStates(VISCOSITY, times, rng.normal(size=(40, 3)))]
    return rates, basis, rate_basis(rates, basis, visited)


@pytest.mark.parametrize("sampling", [QDEIM(40), NonNegativeWeights(120)])
def test_an_equation_of_state_and_a_force_that_tensors_cannot_have(kicked, sampling):
    rates, basis, modes_of_rates = kicked
    samples = sampling.choose(basis, modes_of_rates)
    model = PointsModel(SampledRates.of_samples(rates, basis, samples), 0.3 * VISCOSITY)
    assert len(samples.points) < 0.5 * len(rates.points)
    a = np.random.default_rng(1).normal(size=3)
    # neither the state, nor the times, nor the viscosity was trained on
    kick, hold = (projected(rates, basis, t, a, 0.3 * VISCOSITY) for t in (0.0071, 1.0))
    scale = np.abs(hold).max()
    assert np.abs(kick - hold).max() > 0.1 * scale
    evaluate = eqx.filter_jit(model.rates)
    for time, wanted in ((0.0071, kick), (1.0, hold)):
        found = evaluate(jnp.asarray(time), jnp.asarray(a), None)
        # the seventh power is no finite sum of the modes of the rates
        np.testing.assert_allclose(found, wanted, rtol=0, atol=2e-4 * scale)


def test_a_vortex_decays_as_it_should_in_the_full_models_loop():
    scene = taylor_green(24, 100.0, arrangement=Lattice(), end_time=0.1)
    points, time = scene.state.position, 0.02 * np.arange(6)
    snapshots = []
    for t in time:
        velocity = exact.velocity(points, t, VISCOSITY)
        pressure = exact.pressure(points, t, VISCOSITY, 1000.0)
        density = to_log_density(scene.fluid.density(pressure), scene.fluid)
        snapshots.append(np.concatenate([density[:, None], velocity], axis=1))
    basis = pod(np.stack(snapshots, axis=-1), Energy(), scene.fluid, 2)
    fluctuation = np.stack(snapshots) - basis.centre[None]
    coordinates = np.einsum("gfm,f,sgf->sm", basis.modes, basis.weights, fluctuation)
    rates = EulerianRates.of_scene(scene, points)
    modes_of_rates = rate_basis(rates, basis, [VisitedStates(VISCOSITY, time, coordinates)])
    samples = NonNegativeWeights(12).choose(basis, modes_of_rates)
    model = PointsModel(SampledRates.of_samples(rates, basis, samples), VISCOSITY)
    assert len(model.dynamics.modes) <= len(points)
    assert model.dynamics.gather.shape == (2, len(samples.points), 3)

    @eqx.filter_jit
    def run(viscosity):
        swept = eqx.tree_at(lambda m: m.values, model, viscosity)
        first = jnp.asarray(coordinates[0])
        return integrate(swept, first, jnp.asarray(0), jnp.asarray(5e-3), 4, 5)[1:3]

    viscosities = VISCOSITY * jnp.asarray([1.0, 2.0])
    fault, found = jax.vmap(run)(viscosities)
    assert not np.any(fault.code) and found.shape == (2, 5, 2)
    energy = np.sum(np.asarray(found) ** 2, axis=2) / np.sum(coordinates[0] ** 2)
    wanted = np.exp(-16 * np.pi**2 * np.asarray(viscosities)[:, None] * time[None, 1:])
    np.testing.assert_allclose(np.log(energy), np.log(wanted), rtol=0.05)  # the kernel smooths


def test_coordinates_that_are_lost_are_a_fault(kicked):
    rates, basis, modes_of_rates = kicked
    samples = QDEIM(3).choose(basis, modes_of_rates)
    model = PointsModel(SampledRates.of_samples(rates, basis, samples), VISCOSITY)
    fault = model.inspect(jnp.asarray(7), jnp.asarray([0.0, jnp.nan, 0.0]), None)
    assert (int(fault.code), int(fault.step)) == (int(FaultCode.NOT_FINITE), 7)


def test_no_state_is_named(kicked):
    rates, basis, _ = kicked
    with pytest.raises(ValueError, match="no state is given"):
        rate_basis(rates, basis, [])
