"""One body force, which fluid and walls both read."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph.effects import Gravity
from jaxsph.particles import ParticleState
from jaxsph.scenes import dam_break, hydrostatic_tank
from jaxsph.schemes import Consistent, DeltaPlus

DOWN, LEFT = jnp.asarray([0.0, -1.0]), jnp.asarray([-1.0, 0.0])
SCHEMES = [DeltaPlus(), Consistent()]


@pytest.fixture(scope="module", params=SCHEMES, ids=["delta-plus", "consistent"])
def tank(request):
    """A tank on a lattice, each particle's density a little off."""
    scene = hydrostatic_tank(10, end_time=0.1, scheme=request.param)
    noise = 1e-3 * np.random.default_rng(0).normal(size=len(scene.state.density))
    return eqx.tree_at(lambda s: s.state.density, scene, scene.state.density * (1.0 + noise))


@eqx.filter_jit
def rates(functional, state, neighbors):
    return functional(jnp.zeros(()), state, neighbors)


def listed(scene):
    return scene.search().build(scene.state.position)


def test_gravity_that_is_turned_turns_the_flow_at_walls_too(tank):
    """x and y exchanged in the particles and in gravity, all rates are those with x and y
    exchanged."""
    side = 10
    order = np.arange(side**2).reshape(side, side).T.reshape(-1)
    state = tank.state
    swapped = ParticleState(
        state.position[order][:, ::-1], state.velocity[order][:, ::-1], state.density[order]
    )
    np.testing.assert_allclose(swapped.position, state.position, atol=1e-14)
    functional, neighbors = tank.functional(), listed(tank)
    found = rates(functional.with_effect(Gravity(LEFT)), swapped, neighbors)
    upright = rates(functional, state, neighbors)
    scale = float(jnp.abs(upright.velocity).max())
    np.testing.assert_allclose(
        found.velocity, upright.velocity[order][:, ::-1], atol=1e-10 * scale
    )
    np.testing.assert_allclose(found.density, upright.density[order], atol=1e-8)


def test_a_force_that_is_appended_is_known_to_walls(tank):
    """Half of gravity and the other half appended are gravity."""
    functional, neighbors = tank.functional(), listed(tank)
    half = functional.with_effect(Gravity(0.5 * DOWN))
    halves = eqx.tree_at(
        lambda f: f.effects, half, (*half.effects, Gravity(0.5 * DOWN)),
        is_leaf=lambda x: isinstance(x, tuple),
    )  # fmt: skip
    whole, found = (rates(f, tank.state, neighbors) for f in (functional, halves))
    np.testing.assert_allclose(found.velocity, whole.velocity, atol=1e-11)
    np.testing.assert_allclose(found.density, whole.density, atol=1e-8)


@pytest.mark.parametrize("make", [hydrostatic_tank, dam_break])
@pytest.mark.run_once
def test_gravity_stands_once_and_its_derivative_is_that_of_all_it_does(make):
    options = {"scheme": DeltaPlus()} if make is hydrostatic_tank else {}
    scene = make(20, end_time=0.1, **options)
    functional, neighbors = scene.functional(), listed(scene)
    kept = [leaf for leaf in jax.tree.leaves(functional.effects) if leaf.shape == (2,)]
    assert len(kept) == 1
    gravity = kept[0]
    weight = jnp.asarray(np.random.default_rng(1).normal(size=scene.state.velocity.shape))

    def weighed(gravity):
        changed = functional.with_effect(Gravity(gravity))
        return jnp.sum(weight * rates(changed, scene.state, neighbors).velocity)

    slope = jax.grad(weighed)(gravity)
    for k in range(2):
        step = jnp.zeros(2).at[k].set(1e-3)
        difference = (weighed(gravity + step) - weighed(gravity - step)) / 2e-3
        np.testing.assert_allclose(slope[k], difference, rtol=1e-6)
    # what gravity does to the fluid alone is not all of it: ghosts carry the rest
    assert abs(slope[1] - jnp.sum(weight[:, 1])) > 0.1
