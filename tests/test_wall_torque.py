"""Torque on cylinders that rest and that turn, of exact flows between them."""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import (
    BallRegion,
    Box,
    Fluid,
    MovingWall,
    ParticleState,
    Space,
    WallForces,
    WallPart,
    Walls,
)
from jaxsph.arrangements import Lattice
from jaxsph.kernels import WendlandC2
from jaxsph.scenes import Scene
from jaxsph.schemes import SharpAtWalls
from jaxsph.walls.turning import Turning

INNER, OUTER, NU, RHO0 = 0.5, 1.0, 0.05, 1000.0  # m, m, m^2/s, kg/m^3
MIDDLE = BallRegion((0.0, 0.0), INNER)


def turn(position):
    """By 1 rad/s around the origin."""
    return jnp.stack([-position[:, 1], position[:, 0]], axis=1)


@pytest.fixture(scope="module")
def annulus():
    """Between two cylinders that turn; 12 particles to the inner one's radius."""
    dx = INNER / 12
    box = Box((-1.3, -1.3), (1.3, 1.3), (False, False))
    space, region = Space(box, WendlandC2(), 2.0 * dx, dx), BallRegion((0.0, 0.0), OUTER) & ~MIDDLE
    parts = [WallPart("inner", MIDDLE), WallPart("outer", ~BallRegion((0.0, 0.0), OUTER))]
    moving = [MovingWall(part.region, turn) for part in parts]
    walls = Walls.around(region, space, moving, parts=parts)
    position = Lattice().positions(space)
    position = position[np.asarray(region.signed_distance(position)) < 0.0]
    position = walls.put_inside(position, 0.25 * dx)
    state = ParticleState(position, turn(position), jnp.full(len(position), RHO0))
    effects = SharpAtWalls().effects(NU, None, region)
    fluid = Fluid(RHO0, 10.0, 1.0)
    return Scene("annulus", effects, fluid, space, state, 1e-3, 1e-2, 10, walls=walls)


@pytest.fixture(scope="module")
def measure(annulus):
    return WallForces.of(annulus)


def torques(scene, measure):
    return measure(scene.model(), jnp.zeros(()), scene.state)[1]


def test_fluid_that_turns_with_its_walls_feels_none(annulus, measure):
    found = torques(annulus, measure)
    # of what mu du/dr alone would do to each: the antisymmetric part of the gradient
    for name, radius in (("inner", INNER), ("outer", OUTER)):
        assert abs(found[name]) < 0.02 * 2.0 * np.pi * radius**2 * NU * RHO0


def test_torque_between_one_that_turns_and_one_at_rest(annulus, measure):
    """4 pi mu b of u = a r + b / r: the same on both, as nothing in between keeps any."""
    walls, position = annulus.walls, annulus.state.position
    resting = np.linalg.norm(walls.position, axis=1) > 0.5 * (INNER + OUTER)
    still = jnp.where(resting[:, None], 0.0, walls.velocity)
    b = 1.0 / (INNER**-2 - OUTER**-2)
    around = b * (jnp.sum(position**2, axis=1) ** -1.0 - OUTER**-2)
    state = dataclasses.replace(annulus.state, velocity=turn(position) * around[:, None])
    walls = eqx.tree_at(lambda w: w.velocity, walls, still)
    scene = dataclasses.replace(annulus, walls=walls, state=state)
    found, exact = torques(scene, measure), 4.0 * np.pi * NU * RHO0 * b
    # one instant on a lattice that cuts the surface anyhow; means are in the benchmark
    assert found["inner"] == pytest.approx(-exact, rel=0.02)
    assert found["outer"] == pytest.approx(exact, rel=0.02)


def test_walls_that_slide_or_rest_do_not_turn():
    place = np.stack(np.meshgrid(np.arange(5.0), np.arange(3.0)), axis=-1).reshape(-1, 2)
    held, points = np.ones((1, 15), bool), np.ones((1, 4), bool)
    for velocity in (0.0 * place, 0.0 * place + [1.0, 0.0], place * [[0.0, 1.0]]):
        assert Turning.of(place, velocity, held, points) is None
    spin = place[:, ::-1] * [[-1.0, 1.0]] + [3.0, 0.0]
    gradient = Turning.of(place, spin, held, points).gradient(jnp.asarray(spin))
    np.testing.assert_allclose(gradient[2], [[0.0, 1.0], [-1.0, 0.0]], atol=1e-12)


def test_a_wall_has_the_velocity_of_its_surface(annulus):
    """Not that of a rigid body around its ghosts, which lie deeper."""
    speed = np.linalg.norm(annulus.walls.velocity, axis=1)
    radius = np.linalg.norm(annulus.walls.position, axis=1)
    inner = radius < INNER
    np.testing.assert_allclose(speed[inner], INNER, rtol=1e-3)
    np.testing.assert_allclose(speed[~inner], OUTER, rtol=1e-3)
