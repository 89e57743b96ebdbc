"""Rates at fixed points: what they are, and that a few of them need only what is around them."""

import dataclasses
from functools import cache

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import ParticleState
from jaxsph.arrangements import Lattice
from jaxsph.ramps import ramp
from jaxsph.scenes import lid_driven_cavity, open_cavity, poiseuille_open, taylor_green
from jaxsph_rom.points import EulerianRates, ReferenceOperators, to_log_density
from jaxsph_rom.points.dynamics.fixed_points import on_points
from jaxsph_rom.points.dynamics.point_lists import neighbors_at

SCENES = {
    "periodic": lambda: taylor_green(24, 100.0, arrangement=Lattice()),
    "lid": lambda: lid_driven_cavity(24, 100.0),
    "kick": lambda: open_cavity(32),
}
VISCOSITY = jnp.asarray(0.02)


@cache
def made(name):
    """A scene, its rates on all points, and these compiled."""
    scene = SCENES[name]()
    rates = EulerianRates.of_scene(scene, scene.state.position)
    return scene, rates, eqx.filter_jit(rates)


@pytest.mark.parametrize("name", SCENES)
def test_rates_at_samples_need_only_what_is_around_them(name):
    scene, rates, everywhere = made(name)
    place, rng = scene.state.position, np.random.default_rng(0)
    fields = rng.normal(size=(len(place), 3))
    fields[:, 0] = float(scene.fluid.reference_density) * (1.0 + 0.01 * fields[:, 0])
    samples = [  # in corners and in the middle
        int(jnp.argmin(jnp.sum(place, axis=1))),
        int(jnp.argmax(place[:, 0] + 2.0 * place[:, 1])),
        len(place) // 2,
    ]
    around, members = rates.around(samples)
    assert list(members[:3]) == samples and len(np.unique(members)) == len(members) < len(place)
    if scene.walls is not None:
        assert 0 < len(around.functional.walls.position) < len(scene.walls.position)
    time = jnp.asarray(0.01)
    whole = np.asarray(everywhere(time, jnp.asarray(fields), VISCOSITY))
    part = np.asarray(eqx.filter_jit(around)(time, jnp.asarray(fields[members]), VISCOSITY))
    scale = np.abs(whole).max(axis=0)
    np.testing.assert_allclose(part[:3] / scale, whole[samples] / scale, rtol=0, atol=1e-13)
    assert np.abs(part[3:] / scale - whole[members[3:]] / scale).max() > 1e-3  # at the rim


def test_small_fluctuations_have_the_rates_of_the_reference_operators():
    # what is quadratic goes, and so do changing volumes
    scene, _, everywhere = made("periodic")
    density = to_log_density(scene.state.density, scene.fluid)
    fields = jnp.concatenate([density[:, None], scene.state.velocity], axis=1)
    centre = jnp.zeros_like(fields).at[:, 0].set(scene.fluid.reference_density)
    fields = centre + 1e-5 * (fields - centre)
    found = np.asarray(everywhere(jnp.zeros(()), fields, VISCOSITY))
    operators = ReferenceOperators.of_scene(scene, scene.state.position)
    wanted = np.asarray(eqx.filter_jit(operators.affine)(fields, VISCOSITY))
    scale = np.abs(wanted).max(axis=0)
    np.testing.assert_allclose(found / scale, wanted / scale, rtol=0, atol=2e-4)


def test_a_force_acts_when_it_acts():
    scene, rates, everywhere = made("kick")
    rest = jnp.zeros((len(rates.points), 3)).at[:, 0].set(scene.fluid.reference_density)
    x, y = np.asarray(rates.points).T
    driven = (np.abs(x - 0.2) < 0.1) & (np.abs(y - 0.05) < 0.01)
    for time, wanted in ((0.0, 100.0 / (1.0 + np.exp(-4.0)) + 0.1), (1.0, 0.1)):
        found = np.asarray(everywhere(jnp.asarray(time), rest, VISCOSITY))
        np.testing.assert_allclose(found[driven, 1], wanted, rtol=1e-12)


def test_samples_that_are_no_points_are_named():
    _, rates, _ = made("periodic")
    for wrong, match in (([], "at least one"), ([3, 3], "each once"), ([576], "0 to 575")):
        with pytest.raises(ValueError, match=match):
            rates.around(wrong)


def test_a_fringe_governs_what_particles_feel_and_no_advection():
    """With it less without it: s (pull - f), f without the advection of fields."""
    scene = poiseuille_open(8, h_over_dx=1.5, arrangement=Lattice())
    *others, fringe = scene.effects
    points, time = scene.state.position, jnp.zeros(())
    x, y = points.T
    velocity = jnp.stack([1.0 + 0.2 * jnp.sin(3.0 * x), 0.1 * jnp.sin(2.0 * y + x)], axis=1)
    density = jnp.full((len(x), 1), scene.fluid.reference_density)
    fields = jnp.concatenate([density, velocity], axis=1)
    free = dataclasses.replace(scene, effects=tuple(others), solution=None)
    with_it, without = (
        rates(time, fields, rates.coefficients.values(rates.functional))
        for rates in (EulerianRates.of_scene(s, points) for s in (scene, free))
    )
    functional = on_points(free)
    state = ParticleState(points, velocity, density[:, 0])
    felt = functional(time, state, neighbors_at(functional, points)).velocity
    share = ramp((x - fringe.start) / (fringe.end - fringe.start), 0.0, 0.5)[:, None]
    pull = -fringe.rate * (velocity - fringe.profile(points, time))
    assert float(share.max()) == 1.0
    found = (with_it - without)[:, 1:]
    np.testing.assert_allclose(found, share * (pull - felt), atol=1e-10)
    np.testing.assert_array_equal(with_it[:, 0], without[:, 0])
