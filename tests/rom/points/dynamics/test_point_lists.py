"""Lists of fixed points against all pairs."""

import jax
import numpy as np
import pytest

from jaxsph import Box
from jaxsph.arrangements import Lattice
from jaxsph.scenes import lid_driven_cavity, taylor_green, taylor_green_3d
from jaxsph_rom.points.dynamics.fixed_points import on_points
from jaxsph_rom.points.dynamics.point_lists import neighbors_at


def pairs(box: Box, one, other, radius):
    """Which of `other` are within a radius of each of `one`, by all distances."""
    apart = np.asarray(one)[:, None] - np.asarray(other)[None]
    lengths = np.where(box.periodic, box.lengths, np.inf)
    turns = np.round(apart / lengths[None, None])
    apart = apart - np.where(turns == 0.0, 0.0, turns * np.asarray(box.lengths)[None, None])
    return np.sqrt((apart**2).sum(axis=2)) < radius


def listed(index, rows, columns):
    """The same of rows of a list, whose free slots hold the row's own number."""
    found = np.zeros((len(rows), columns), bool)
    for k, row in enumerate(rows):
        entries = np.asarray(index[row])
        real = entries[entries != row]
        assert len(real) == len(set(real))  # each pair once
        found[k, real] = True
    return found


@pytest.mark.parametrize(
    "scene",
    [
        taylor_green(16, end_time=0.06, arrangement=Lattice()),
        taylor_green_3d(12, end_time=0.1),
        lid_driven_cavity(10),
    ],
    ids=lambda scene: scene.name,
)
def test_lists_hold_all_pairs_and_no_others(scene):
    functional, points = on_points(scene), scene.state.position
    box, support = scene.space.box, scene.space.support
    within, at_most = support * (1.0 - 1e-9), support * (1.0 + 1e-9)  # at the rim either will do
    found = neighbors_at(functional, points)
    assert not found.overflow
    fluid = found if scene.walls is None else found.fluid
    count = len(points)
    others = ~np.eye(count, dtype=bool)
    mine = listed(fluid.index, range(count), count)
    assert (mine >= (pairs(box, points, points, within) & others)).all()
    assert (mine <= (pairs(box, points, points, at_most) & others)).all()
    field = np.random.default_rng(0).uniform(size=count)
    np.testing.assert_array_equal(fluid.unsort(fluid.sort(jax.numpy.asarray(field))), field)
    if scene.walls is None:
        return
    ghosts, wall = np.asarray(scene.walls.position), found.wall
    least, most = (pairs(box, points, ghosts, reach) for reach in (within, at_most))
    rows, (first, last) = len(wall.index), wall.ghost_rows
    sees = listed(wall.index, range(first), rows)[:, first:last]
    at = np.ix_(wall.near, wall.ghosts)
    assert (sees >= least[at]).all() and (sees <= most[at]).all()
    assert not least[np.setdiff1d(np.arange(count), wall.near)].any()
    seers = listed(wall.index, range(first, last), rows)[:, :first]
    assert (seers == sees.T).all()
