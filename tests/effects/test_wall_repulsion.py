"""The repulsion by walls: where it acts, and what it holds."""

import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import Box, BoxRegion, Fluid, ParticleState, Space, Walls, run_scene
from jaxsph.arrangements import Lattice
from jaxsph.effects import Context, WallRepulsion
from jaxsph.kernels import WendlandC2
from jaxsph.scenes import Scene
from jaxsph.schemes import Consistent, DeltaPlus

RHO0, C0 = 1000.0, 10.0
DX = 0.1
SQUARE = BoxRegion((0.0, 0.0), (1.0, 1.0))


def make_space():
    return Space(Box((0.0, 0.0), (1.0, 1.0), (False, False)), WendlandC2(), 2.0 * DX, DX)


def repulsion(region, position):
    fluid = Fluid(RHO0, C0, 1.0)
    context = Context(jnp.asarray(0.0), fluid, jnp.asarray(RHO0 * DX**2), make_space())
    fields = {"position": jnp.asarray(position)}
    return np.asarray(WallRepulsion(region).rates(context, fields, {})["velocity"])


def test_repulsion_acts_next_to_walls_only_and_away_from_them():
    found = repulsion(SQUARE, Lattice().positions(make_space()))
    np.testing.assert_array_equal(found, 0.0)  # half a spacing away, and farther
    edge = ~BoxRegion((0.0, 0.0), (0.5, 0.5))  # solid, its corner juts into the fluid
    x = np.asarray([[0.25, 0.5 + 0.1 * DX], [0.5 + 0.06 * DX, 0.5 + 0.08 * DX], [0.7, 0.7]])
    found = repulsion(edge, x)
    assert np.all(found[2] == 0.0)
    normal = np.asarray([[0.0, 1.0], [0.6, 0.8]])  # from the nearest point of the solid
    strength = 0.2 * C0**2 / DX * (1.0 - 0.1 / 0.15) ** 2  # both are 0.1 dx away
    np.testing.assert_allclose(found[:2], strength * normal, rtol=1e-11)  # distances of 1e-2


def test_repulsion_holds_what_flies_at_a_wall_with_up_to_a_seventh_of_the_speed_of_sound():
    region, count = SQUARE, 2001
    depth = np.linspace(0.0, 0.2 * DX, count)
    x = np.stack([np.full(count, 0.5), depth], axis=1)
    force = repulsion(region, x)[:, 1]
    assert np.all(np.diff(force) <= 0.0) and force[-1] == 0.0
    work = np.trapezoid(force, depth)
    # v^2 / 2 = A a c0^2 / (3 dx); quadrature of a parabola with 1500 intervals: 1e-6
    assert np.sqrt(2.0 * work) == pytest.approx(np.sqrt(0.02) * C0, rel=1e-6)


@pytest.mark.parametrize("scheme", [DeltaPlus(), Consistent()], ids=["delta-plus", "consistent"])
def test_a_row_near_a_wall_is_stable_at_the_longest_step(scheme):
    """One row is 0.06 spacings from the wall; at 0.05 it would be refused."""
    box = Box((0.0, 0.0), (1.0, 0.6), (True, False))
    space = Space(box, WendlandC2(), 2.0 * DX, DX)
    channel = BoxRegion((-np.inf, 0.0), (np.inf, 0.45 + 0.06 * DX))
    position = Lattice().positions(space)
    position = position[np.asarray(channel.signed_distance(position)) < 0.0]
    state = ParticleState(position, 0.0 * position, jnp.full(len(position), RHO0))
    effects = scheme.effects(5e-3, vessel=channel)
    fluid = Fluid(RHO0, C0, 1.0)
    longest = WallRepulsion(channel).step_limit_from(position, fluid, space)
    assert longest == pytest.approx(2.83 * (0.15 / 0.4 / 0.6) ** 0.5 * DX / C0, rel=1e-2)
    assert WallRepulsion(channel).step_limit_from(position - 0.1 * DX, fluid, space) == np.inf

    def scene(step):
        walls = Walls.around(channel, space)
        return Scene(
            "near", effects, fluid, space, state, step, 60 * step, 60, walls=walls
        )

    with pytest.raises(ValueError, match="time step: .* close to a wall"):
        scene(1.05 * longest)
    speed = np.linalg.norm(run_scene(scene(longest)).velocity, axis=2).max(axis=1)
    # thrown off with at most c0 (2 A a (1 - d / a)^3 / (3 dx))^(1/2) = 0.66 m/s, then slowed
    assert speed[-1] < 0.5
