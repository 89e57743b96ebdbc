"""The consistent scheme at free surfaces: walls that do not pump, noise that dies, pairs apart."""

import dataclasses
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from benchmarks.free_surfaces import still_water
from jaxsph import Box, Fluid, Space, run_scene
from jaxsph.effects import (
    AdjointContinuity,
    Context,
    FreeSlip,
    FreeSurface,
    GrippedPressureForce,
    KernelCorrection,
    PairRepulsion,
    VelocityDiffusion,
    WallPressure,
)
from jaxsph.effects.adjoint_continuity import moving_ghost_flux, moving_wall_divergence
from jaxsph.integrate import rk4_step
from jaxsph.kernels import WendlandC2
from jaxsph.scenes import dam_break
from jaxsph.schemes import Consistent
from jaxsph.vector import Vector

from .test_energy import CORNERED, energy_rate
from .vessels import disturbed, rates_of, vessel

WALLS = (FreeSurface(), AdjointContinuity(), GrippedPressureForce(), WallPressure(), FreeSlip())


def of(effects, **options):
    return dataclasses.replace(vessel(**options), effects=effects)


def half_full(scene):
    """The lower half of its particles, which have a free surface."""
    low = np.asarray(scene.state.position[:, -1] < scene.space.box.upper[-1] / 2)
    return dataclasses.replace(scene, state=jax.tree.map(lambda a: a[low], scene.state))


@pytest.mark.parametrize(
    "options", [dict(side=10), dict(side=14, region=CORNERED), dict(side=6, dim=3)], ids=str
)
def test_walls_and_free_surface_only_exchange_energy(options):
    scene = half_full(of(WALLS, **options))
    assert abs(energy_rate(scene, disturbed(scene))) < 1e-13  # round-off


def film(scene):
    """Its particles beside the first wall of the first direction: a single layer."""
    layer = np.asarray(scene.state.position[:, 0]) < scene.space.box.lower[0] + scene.space.spacing
    return dataclasses.replace(scene, state=jax.tree.map(lambda a: a[layer], scene.state))


@pytest.mark.parametrize(
    "options", [dict(side=14), pytest.param(dict(side=10, dim=3), marks=pytest.mark.slow)], ids=str
)
def test_a_film_slides_along_its_wall(options):
    scene = film(of(WALLS, **options))
    found = rates_of(scene)(disturbed(scene)).velocity
    middle = np.asarray(scene.state.position[:, 1:])
    assert abs(energy_rate(scene, disturbed(scene))) < 1e-13
    # ghosts beyond the ends of the wall have other normals
    reach, box = scene.space.support, scene.space.box
    inner = ((middle > np.asarray(box.lower[1:]) + reach)
             & (middle < np.asarray(box.upper[1:]) - reach)).all(axis=1)  # fmt: skip
    assert inner.any()
    alone = dataclasses.replace(scene, walls=None)
    between = rates_of(alone)(disturbed(alone)).velocity
    apart = np.asarray(found - between)[inner]
    assert np.abs(apart[:, 1:]).max() < 1e-12 * np.abs(apart[:, 0]).max()


def test_a_ghost_gathers_the_velocity_relative_to_its_wall():
    pair = SimpleNamespace(gradient=Vector((0.3, 0.7)), kernel=1.0)
    row = SimpleNamespace(
        velocity=Vector((1.0, 2.0)), wall_velocity=Vector((1.0, 2.0)), gathered_flux=0.0,
        volume=1.0, normal=Vector((0.0, 1.0)), wall_grip=0.3,
    )  # fmt: skip
    assert moving_ghost_flux(pair, row, row) == 0.0
    assert moving_wall_divergence(pair, row, row) == 0.0


def test_velocity_diffusion_leaves_linear_fields_alone():
    effects = (KernelCorrection(), FreeSurface(), VelocityDiffusion(0.1))
    scene = half_full(dataclasses.replace(vessel(12), walls=None, effects=effects))
    slope = jnp.asarray([[0.3, -1.2], [0.7, 0.4]])
    state = dataclasses.replace(scene.state, velocity=scene.state.position @ slope.T + 2.0)
    assert jnp.abs(rates_of(scene)(state).velocity).max() < 1e-12  # of 10 / s times some m/s
    noisy = disturbed(scene)
    found = rates_of(scene)(noisy)
    size = jnp.abs(found.velocity).sum()
    assert jnp.abs(found.velocity.sum(axis=0)).max() < 1e-13 * size
    turning = noisy.position[:, 0] * found.velocity[:, 1]
    turning = turning - noisy.position[:, 1] * found.velocity[:, 0]
    assert jnp.abs(turning.sum()) < 1e-12 * jnp.abs(turning).sum()
    assert (noisy.velocity * found.velocity).sum() < 0.0


def test_pair_repulsion_has_a_potential_and_spares_even_particles():
    scene = of((PairRepulsion(),), side=10, periodic=True)
    assert jnp.abs(rates_of(scene)(scene.state).velocity).max() == 0.0
    position = scene.state.position.at[3].set(scene.state.position[40] + jnp.asarray([0.2, 0.1]))
    close = dataclasses.replace(scene, state=dataclasses.replace(scene.state, position=position))
    found = rates_of(close)(close.state).velocity
    reach, strength = 0.4, 4.0 / 9.0 * (10.0 / 2.0) ** 2  # c0 = 10 m/s, h = 2 m

    def potential(x):
        squared = jnp.sum((x - position[40]) ** 2)
        return strength * reach**2 / 4.0 * (1.0 - squared / reach**2) ** 2

    np.testing.assert_allclose(found[3], -jax.grad(potential)(position[3]), rtol=1e-12)
    np.testing.assert_allclose(found.sum(axis=0), 0.0, atol=1e-12)


@pytest.mark.parametrize("step", [1.5, 1.0])
def test_pairs_that_meet_gain_no_energy_on_the_average(step):
    """Head on, by RK4 steps of up to the sound's limit in h / c0, at many phases of a step."""
    space = Space(Box((0.0, 0.0), (1.0, 1.0), (True, True)), WendlandC2(), 2.0, 1.0)
    context = Context(jnp.zeros(()), Fluid(1.0, 10.0, 1.0), jnp.asarray(1.0), space)
    term = PairRepulsion().rate_terms(context)[0]
    still = jnp.zeros(1000)

    def slope(_, place):
        pair = SimpleNamespace(separation=Vector((place[0], still)), squared_distance=place[0] ** 2)
        total = jnp.stack(term.function(pair, None, None), axis=1)
        found = PairRepulsion().rates(context, {}, {"closeness": total})["velocity"][:, 0]
        return jnp.stack([place[1], -2.0 * found])  # of the other particle's approach

    dt = step * 2.0 / 10.0
    for speed in (0.1, 0.3, 1.0):
        phase = jnp.linspace(0.0, 1.0, 1000)
        place = jnp.stack([0.4 + speed * dt * phase, jnp.full(1000, -speed)])
        for _ in range(int(4.0 + 1.0 / (speed * dt))):
            place = rk4_step(slope, jnp.zeros(()), place, jnp.asarray(dt))
        ratio = place[1] ** 2 / speed**2
        assert place[0].min() > 0.4  # apart again
        assert ratio.mean() < 1.0 and ratio.max() < 1.5


@pytest.mark.slow
def test_still_water_stays_level():
    found = run_scene(still_water(2, 8, end=6.0))
    level = 2.0 * found.position[:, :, 1].mean(axis=1)
    assert np.abs(level - 1.0).max() < 0.003
    speed = np.linalg.norm(found.velocity, axis=2).max(axis=1)
    assert speed[-5:].max() < 0.02  # of (g H)^(1/2), with an inviscid fluid


@pytest.mark.parametrize(
    "along",
    [40, pytest.param(50, marks=pytest.mark.slow), pytest.param(30, marks=pytest.mark.slow)],
)
def test_a_dam_break_passes_the_corner_at_any_resolution(along):
    found = run_scene(dam_break(along, end_time=0.5, scheme=Consistent()))
    assert np.abs(found.density / 1000.0 - 1.0).max() < 0.06
