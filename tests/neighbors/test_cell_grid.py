"""The cell grid: every point in its cell, each cell's neighbourhood complete, none twice."""

import itertools
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from jaxsph import Box, CellGrid
from tests.neighbors.longest_run import longest_run

CLOSED, PERIODIC = False, True
GRIDS = [
    CellGrid(Box((0.0, -1.0), (1.0, 1.0), (PERIODIC, PERIODIC)), (6, 7)),
    CellGrid(Box((0.0, -1.0), (1.0, 1.0), (PERIODIC, CLOSED)), (5, 6), reach=2),
    CellGrid(Box((0.0, 0.0, 0.0), (1.0, 2.0, 0.5), (PERIODIC, CLOSED, PERIODIC)), (5, 6, 7), 2),
    # narrow: the stencil would meet itself through the periodic faces
    CellGrid(Box.unit_periodic(2), (2, 3), reach=2),
    CellGrid(Box((0.0, 0.0), (1.0, 1.0), (PERIODIC, CLOSED)), (1, 2), reach=2),
    CellGrid(Box.unit_periodic(3), (4, 2, 3), reach=2),
]
each_grid = pytest.mark.parametrize("grid", GRIDS, ids=lambda g: f"{g.shape}-{g.reach}")


def uniform_points(grid, seed, count=60, stretch=0.0):
    """In the box, or up to `stretch` lengths beyond it."""
    unit = np.random.default_rng(seed).uniform(-stretch, 1.0 + stretch, (count, grid.box.dim))
    return jnp.asarray(unit * np.asarray(grid.box.lengths) + np.asarray(grid.box.lower))


@each_grid
def test_stencil_is_the_cells_within_reach(grid):
    cells = list(np.ndindex(*grid.shape))
    for number, here in enumerate(cells):
        expected = set()
        for offset in itertools.product(range(-grid.reach, grid.reach + 1), repeat=len(here)):
            there = []
            for place, n, periodic in zip(
                np.add(here, offset), grid.shape, grid.box.periodic, strict=True
            ):
                there.append(int(place) % n if periodic else int(place))
            if all(0 <= place < n for place, n in zip(there, grid.shape, strict=True)):
                expected.add(cells.index(tuple(there)))
        row = grid.stencil[number]
        inside = row[row < grid.cells].tolist()
        assert sorted(inside) == sorted(expected)  # as lists: no cell twice
        assert np.all(row <= grid.cells)


@each_grid
def test_stencil_is_symmetric(grid):
    pairs = {(c, int(d)) for c, row in enumerate(grid.stencil) for d in row if d < grid.cells}
    assert pairs == {(d, c) for c, d in pairs}


@each_grid
def test_centres_lie_in_their_own_cells(grid):
    np.testing.assert_array_equal(grid.locate(jnp.asarray(grid.centers)), np.arange(grid.cells))
    first = grid.centers[0] - np.asarray(grid.box.lower)
    np.testing.assert_allclose(first, 0.5 * np.asarray(grid.widths), rtol=1e-12)  # round-off


@each_grid
@settings(max_examples=40)
@given(seed=st.integers(0, 2**32 - 1))
def test_locate_agrees_with_the_cell_bounds(grid, seed):
    x = uniform_points(grid, seed)
    away = np.abs(np.asarray(x) - grid.centers[np.asarray(grid.locate(x))])
    assert np.all(away <= 0.5 * np.asarray(grid.widths) * (1.0 + 1e-12))  # round-off at a face


@each_grid
def test_points_beyond_the_box_wrap_or_belong_to_the_nearest_cell(grid):
    x = np.asarray(uniform_points(grid, 3, stretch=1.5))
    lower, length = np.asarray(grid.box.lower), np.asarray(grid.box.lengths)
    back = np.where(
        grid.box.periodic,
        lower + np.mod(x - lower, length),
        np.clip(x, lower, lower + length * (1.0 - 1e-12)),  # the upper face belongs to no cell
    )
    np.testing.assert_array_equal(grid.locate(jnp.asarray(x)), grid.locate(jnp.asarray(back)))


@partial(jax.jit, static_argnums=(0, 2))
def binned(grid, x, capacity):
    return grid.bin(x, capacity)


def check_bins(grid, x, bins, capacity):
    """All that `CellBins` promises, where no cell overflows."""
    count = x.shape[0]
    cell = np.asarray(grid.locate(x))
    order, inverse = np.asarray(bins.order), np.asarray(bins.inverse)
    assert sorted(order.tolist()) == list(range(count))
    np.testing.assert_array_equal(order[inverse], np.arange(count))
    np.testing.assert_array_equal(bins.cell, cell[order])
    assert np.all(np.diff(cell[order]) >= 0), "sorted by cell"
    assert bins.members.shape == (grid.cells + 1, capacity)
    members = np.asarray(bins.members)
    for c in range(grid.cells):
        held = members[c][members[c] < count]
        assert sorted(order[held].tolist()) == np.flatnonzero(cell == c).tolist()
    assert np.all(members[grid.cells] == count), "the row past the last cell is empty"
    np.testing.assert_array_equal(members[bins.cell, bins.slot], np.arange(count))
    assert not bins.overflow


@each_grid
@settings(max_examples=40)
@given(seed=st.integers(0, 2**32 - 1))
def test_bins_hold_every_particle_once(grid, seed):
    x = uniform_points(grid, seed)
    check_bins(grid, x, binned(grid, x, 60), 60)


@each_grid
def test_all_particles_in_one_cell_leave_the_others_empty(grid):
    x = jnp.broadcast_to(jnp.asarray(grid.centers[-1]), (7, grid.box.dim))
    check_bins(grid, x, binned(grid, x, 7), 7)
    assert grid.counts(x).max() == 7


@each_grid
def test_one_particle(grid):
    x = jnp.asarray(grid.centers[:1])
    check_bins(grid, x, binned(grid, x, 1), 1)
    assert grid.counts(x).max() == 1


@each_grid
@settings(max_examples=40)
@given(seed=st.integers(0, 2**32 - 1), capacity=st.sampled_from([1, 3, 12, 60]))
def test_a_cell_that_is_too_full_is_flagged(grid, seed, capacity):
    x = uniform_points(grid, seed)
    fullest = int(grid.counts(x).max())
    assert fullest == np.bincount(np.asarray(grid.locate(x))).max()
    assert bool(binned(grid, x, capacity).overflow) == (fullest > capacity)


def test_the_fullest_cell_may_be_exactly_full():
    grid = GRIDS[0]
    x = uniform_points(grid, 5)
    fullest = int(grid.counts(x).max())
    check_bins(grid, x, binned(grid, x, fullest), fullest)
    assert binned(grid, x, fullest - 1).overflow


@given(width=st.floats(0.01, 3.0))
def test_width_is_a_lower_bound_and_the_finest(width):
    box = Box((0.0, -2.0), (1.0, 0.5), (PERIODIC, CLOSED))
    grid = CellGrid.with_width(box, width)
    for length, got, n in zip(box.lengths, grid.widths, grid.shape, strict=True):
        assert got >= width * (1.0 - 1e-12) or n == 1  # round-off of the division
        assert length / (n + 1) < width * (1.0 + 1e-12)


@each_grid
@settings(max_examples=20)
@given(seed=st.integers(0, 2**32 - 1), few=st.sampled_from([0, 1, 5, 40]))
def test_the_longest_run_is_counted_as_one_by_one(grid, seed, few):
    here, there = uniform_points(grid, seed, few), uniform_points(grid, seed + 1, 50)
    counts = grid.counts(here), grid.counts(there)
    assert grid.longest_run(*counts) == longest_run(grid, here, there)
    assert grid.longest_run(*counts[::-1]) == longest_run(grid, there, here)
