"""Scenes between walls refuse what does not fit, and take odd sizes right."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import Box, BoxRegion, Fluid, MovingWall, SignedDistance, Space, Walls
from jaxsph.arrangements import JitteredLattice
from jaxsph.effects import Context, WallRepulsion
from jaxsph.kernels import WendlandC2
from jaxsph.scenes import couette, lid_driven_cavity, open_cavity


@pytest.mark.parametrize("resolution, h_over_dx", [(10, 2.0), (16, 4.0), (25, 2.0)])
def test_a_channel_is_filled_evenly_from_wall_to_wall(resolution, h_over_dx):
    scene = couette(resolution, h_over_dx=h_over_dx)
    dx, box = scene.space.spacing, scene.space.box
    assert dx == pytest.approx(1.0 / resolution, rel=1e-12)
    total = float(scene.mass) * scene.state.position.shape[0]
    assert total == pytest.approx(box.volume, rel=1e-12)  # rho0 = 1
    nearest = np.abs(np.asarray(scene.walls.position)[:, 1] - 0.5).min() - 0.5
    assert nearest == pytest.approx(0.5 * dx, rel=1e-9)


def test_a_particle_moved_into_a_wall_is_refused_not_lost():
    with pytest.raises(ValueError, match="start inside a wall"):
        lid_driven_cavity(12, arrangement=JitteredLattice(amplitude=0.8))


def test_regions_that_touch_without_an_overlap_are_refused():
    box = Box((-1.0, 0.0), (1.0, 1.0), (False, False))
    space = Space(box, WendlandC2(), 0.1, 0.05)
    tank, left = BoxRegion((0.0, 0.0), (1.0, 1.0)), BoxRegion((-1.0, 0.0), (0.0, 0.4))
    with pytest.raises(ValueError, match=r"a wall of no thickness at \(0, .*let them overlap"):
        Walls.around(tank | left, space)
    Walls.around(tank | BoxRegion((-1.0, 0.0), (0.5, 0.4)), space)


def test_an_open_cavity_that_does_not_fit_the_lattice_is_refused():
    with pytest.raises(ValueError, match="multiple of 4"):
        open_cavity(50)


def test_a_lid_that_moves_into_its_wall_is_refused():
    box = Box((0.0, 0.0), (1.0, 1.0), (False, False))
    space = Space(box, WendlandC2(), 0.2, 0.1)
    lid = MovingWall(
        BoxRegion((-np.inf, 1.0), (np.inf, np.inf)), lambda x: jnp.zeros_like(x).at[:, 1].set(1.0)
    )
    with pytest.raises(ValueError, match="across the wall; walls slide along themselves only"):
        Walls.around(BoxRegion((0.0, 0.0), (1.0, 1.0)), space, (lid,))


def test_repulsion_where_the_distance_has_no_slope():
    """In the middle of a disc the gradient of the distance is 0 / 0."""
    disc = SignedDistance(lambda x: jnp.linalg.norm(x, axis=1) - 1.0)
    space = Space(Box((-1.0, -1.0), (1.0, 1.0), (False, False)), WendlandC2(), 0.2, 0.1)
    context = Context(jnp.asarray(0.0), Fluid(1.0, 10.0, 1.0), jnp.asarray(0.01), space)
    x = jnp.asarray([[0.0, 0.0], [0.0, 0.995]])

    @eqx.filter_jit
    def force(x):
        return WallRepulsion(disc).rates(context, {"position": x}, {})["velocity"]

    found = force(x)
    np.testing.assert_array_equal(found[0], 0.0)
    assert float(found[1, 1]) < 0.0  # towards the middle
    slope = jax.jit(jax.grad(lambda x: jnp.sum(force(x) ** 2)))(x)
    assert bool(jnp.isfinite(slope).all())
    walls = Walls.around(disc, space)
    np.testing.assert_array_equal(walls.put_inside(x, 0.02)[0], 0.0)
