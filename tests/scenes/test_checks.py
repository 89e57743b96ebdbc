"""What a scene refuses of its start, and what it takes into its own precision."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import BallRegion, Box, Fluid, ParticleState, Space, Walls, run_scene
from jaxsph.arrangements import Lattice
from jaxsph.effects import ConsistentViscosity, Gravity
from jaxsph.kernels import WendlandC2
from jaxsph.scenes import Scene, hydrostatic_tank, taylor_green
from jaxsph.schemes import DeltaPlus

DX = 0.05


def box_of_fluid(dtype=jnp.float64, origin=0.0, density=1000.0, number=float, steps=10):
    """A fluid at rest around a cylinder in a periodic box, its numbers given as `number`."""
    box = Box((origin, origin), (origin + 1.0, origin + 1.0), (True, True))
    space = Space(box, WendlandC2(), number(2.0 * DX), number(DX))
    body = BallRegion((origin + 0.5, origin + 0.5), number(0.25))
    walls = Walls.around(~body, space)
    position = Lattice().positions(space)
    position = position[np.asarray(body.signed_distance(position)) > 0.25 * DX]
    effects = DeltaPlus().effects(number(0.01), vessel=~body)
    effects = (*effects, Gravity(np.asarray([0.1, 0.0])))
    state = ParticleState(
        jnp.asarray(position, dtype),
        jnp.zeros(position.shape, dtype),
        jnp.full(len(position), density, dtype),
    )
    fluid = Fluid(number(1000.0), number(10.0), number(1.0))
    return Scene(
        "around", effects, fluid, space, state, number(0.01), number(0.01 * steps), 10, walls=walls
    )


@pytest.mark.run_once
def test_numbers_of_numpy_are_taken_into_the_particles_precision():
    scene = box_of_fluid(jnp.float32, number=np.float64)
    found = {leaf.dtype for leaf in jax.tree.leaves(scene) if eqx.is_inexact_array(leaf)}
    assert found == {np.dtype("float32")}
    trajectory = run_scene(scene)
    assert trajectory.velocity.dtype == np.float32
    exact = run_scene(box_of_fluid(jnp.float64))
    np.testing.assert_allclose(trajectory.velocity[-1], exact.velocity[-1], atol=2e-5)


def test_an_effect_put_into_a_functional_takes_its_precision():
    functional = taylor_green(12, arrangement=Lattice(), dtype=jnp.float32).functional()
    changed = functional.with_effect(ConsistentViscosity(np.float64(0.3)))
    assert changed.effects[2].viscosity.dtype == jnp.float32


def test_single_precision_far_from_the_origin_is_refused():
    with pytest.raises(ValueError, match="position: float32 resolves 0.06 m .* float64"):
        box_of_fluid(jnp.float32, origin=5e5)
    with pytest.raises(ValueError, match="position: float32 resolves"):
        box_of_fluid(jnp.float32, origin=2e4)
    box_of_fluid(jnp.float32, origin=100.0)
    box_of_fluid(jnp.float64, origin=5e5)


def test_two_liquids_are_refused():
    scene = taylor_green(12, arrangement=Lattice())
    density = jnp.where(scene.state.position[:, 0] < 0.5, 700.0, 1000.0)
    with pytest.raises(ValueError, match="density: from 700 to 1000 kg/m.* one fluid"):
        dataclasses.replace(scene, state=dataclasses.replace(scene.state, density=density))


def test_one_of_two_effects_of_a_kind_is_not_replaced_in_silence():
    functional = hydrostatic_tank(8, end_time=0.1).functional()
    both = dataclasses.replace(
        functional, effects=(*functional.effects, Gravity(jnp.asarray([0.1, 0.0])))
    )
    with pytest.raises(ValueError, match="effect: there are 2 of the kind Gravity, numbers"):
        both.with_effect(Gravity(jnp.asarray([0.0, -2.0])))
