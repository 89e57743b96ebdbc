"""The Verlet list holds exactly the pairs within its radius, for any particles in any box."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from jaxsph import Box, CellGrid, NeighborSearch
from tests.neighbors.longest_run import longest_run

CLOSED, PERIODIC = False, True
SUPPORT, SKIN = 0.2, 0.03
RADIUS = SUPPORT + SKIN
COUNT = 40
BOXES = {
    "periodic": Box((0.0, -1.0), (1.0, -1.0 + 2.0 * RADIUS), (PERIODIC, PERIODIC)),  # 8 x 4 cells
    "closed": Box((0.0, -1.0), (1.0, 0.0), (CLOSED, CLOSED)),
    "narrow channel": Box((0.0, 0.0), (2.2 * RADIUS, 1.1 * RADIUS), (PERIODIC, CLOSED)),  # 4 x 2
    "cube": Box((0.0, 0.0, -1.0), (0.46, 0.6, -0.4), (PERIODIC,) * 3),  # 4 x 5 x 5
    "narrow cube": Box(
        (0.0,) * 3, (2.1 * RADIUS, 0.4 * RADIUS, 1.6 * RADIUS), (True, False, False)
    ),
}
each_box = pytest.mark.parametrize("box", BOXES.values(), ids=BOXES.keys())
in_2d_and_3d = pytest.mark.parametrize(
    "box", [BOXES["narrow channel"], BOXES["cube"]], ids=["2d", "3d"]
)
seeds = st.integers(0, 2**32 - 1)


def particles(box, seed, count=COUNT, beyond=0.0):
    """Uniform, clustered, coincident particles or on the faces; up to `beyond` lengths outside."""
    rng = np.random.default_rng(seed)
    unit = rng.uniform(-beyond, 1.0 + beyond, (count, box.dim))
    kind = rng.integers(0, 5)
    if kind == 1:  # a cluster, perhaps across a face
        unit = np.mod(rng.uniform(size=box.dim) + rng.normal(0.0, 0.1, unit.shape), 1.0)
    elif kind == 2:  # on faces, edges and corners
        unit = np.where(rng.random(unit.shape) < 0.4, rng.integers(0, 2, unit.shape), unit)
    elif kind == 3:  # at the same places
        unit = unit[rng.integers(0, 1 + count // 4, count)]
    return np.asarray(box.lower) + unit * np.asarray(box.lengths)


@partial(jax.jit, static_argnums=0)
def build(search, position):
    return search.build(position)


def roomy(box, count):
    """A search that cannot overflow."""
    grid = CellGrid.with_width(box, 0.5 * RADIUS, reach=2)
    return NeighborSearch(grid, SUPPORT, SKIN, capacity=max(1, count - 1), run_capacity=count)


def listed_pairs(neighbors):
    """The list as ordered pairs of particle numbers, each row checked on the way."""
    index, order = np.asarray(neighbors.index), np.asarray(neighbors.order)
    own = np.arange(index.shape[0])[:, None]
    real = index != own
    assert np.all((index >= 0) & (index < index.shape[0]))
    rows = np.broadcast_to(own, index.shape)[real]
    pairs = list(zip(order[rows].tolist(), order[index[real]].tolist(), strict=True))
    assert len(set(pairs)) == len(pairs), "no neighbour twice"
    return set(pairs)


def distances(box, position):
    """All N x N distances by the nearest of all images, in numpy."""
    difference = position[None, :, :] - position[:, None, :]
    length = np.where(box.periodic, box.lengths, np.inf)
    difference = difference - np.where(box.periodic, box.lengths, 0.0) * np.round(
        difference / length
    )
    return np.sqrt((difference**2).sum(-1))


def check_complete(box, position, neighbors, margin=1e-12):
    """All pairs within the radius and no others; `margin` around it may go either way."""
    distance = distances(box, position)
    np.fill_diagonal(distance, np.inf)
    found = np.zeros(distance.shape, bool)
    for i, j in listed_pairs(neighbors):
        found[i, j] = True
    assert np.all(found[distance < RADIUS - margin]), "a neighbour is missing"
    assert not np.any(found[distance > RADIUS + margin]), "a stranger is listed"
    np.testing.assert_array_equal(found, found.T)  # symmetric, ties at the radius included
    assert int(neighbors.largest_count) == found.sum(1).max()
    assert not neighbors.overflow


@each_box
@settings(max_examples=40)
@given(seed=seeds)
def test_list_is_all_pairs_within_the_radius(box, seed):
    position = particles(box, seed)
    check_complete(box, position, build(roomy(box, COUNT), jnp.asarray(position)))


@each_box
@settings(max_examples=20)
@given(seed=seeds)
def test_particles_beyond_the_box(box, seed):
    # Between wraps particles leave through periodic faces; ghosts stand outside closed ones.
    position = particles(box, seed, beyond=0.3)
    check_complete(box, position, build(roomy(box, COUNT), jnp.asarray(position)))


@in_2d_and_3d
@settings(max_examples=20)
@given(seed=seeds)
def test_single_precision_list_is_complete_and_symmetric(box, seed):
    position = particles(box, seed).astype(np.float32)
    neighbors = build(roomy(box, COUNT), jnp.asarray(position))
    assert neighbors.reference.dtype == jnp.float32
    # 1e-6: coordinates and periods of order one are rounded to 6e-8, a few times
    check_complete(box, position.astype(float), neighbors, margin=1e-6)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_water_in_the_corner_of_a_large_tank(dim, dtype):
    box = Box((0.0,) * dim, (3.0,) * dim, (CLOSED,) * dim)
    position = np.random.default_rng(2).uniform(0.0, 0.6, (200, dim)).astype(dtype)
    search = NeighborSearch.allocate(jnp.asarray(position), box, SUPPORT, SKIN)
    neighbors = build(search, jnp.asarray(position))
    margin = 1e-6 if dtype == np.float32 else 1e-12  # round-off of coordinates of order one
    check_complete(box, position.astype(float), neighbors, margin)


@each_box
def test_sorted_order_follows_the_cells_and_can_be_undone(box):
    position = jnp.asarray(particles(box, 0))
    search = roomy(box, COUNT)
    neighbors = build(search, position)
    assert np.all(np.diff(np.asarray(search.grid.locate(neighbors.sort(position)))) >= 0)
    np.testing.assert_array_equal(neighbors.unsort(neighbors.sort(position)), position)
    np.testing.assert_array_equal(neighbors.sort(neighbors.unsort(position)), position)
    np.testing.assert_array_equal(neighbors.reference, position)


@each_box
def test_free_slots_point_to_their_own_row_and_come_last(box):
    neighbors = build(roomy(box, COUNT), jnp.asarray(particles(box, 1)))
    free = np.asarray(neighbors.index) == np.arange(COUNT)[:, None]
    assert np.all(np.diff(free.astype(int), axis=1) >= 0)


@in_2d_and_3d
def test_one_particle_has_no_neighbours(box):
    position = jnp.asarray(particles(box, 2, count=1))
    neighbors = build(roomy(box, 1), position)
    assert listed_pairs(neighbors) == set()
    assert int(neighbors.largest_count) == 0 and not neighbors.overflow


@in_2d_and_3d
def test_two_at_the_same_place_are_neighbours(box):
    position = jnp.broadcast_to(jnp.asarray(box.lower), (2, box.dim))
    neighbors = build(roomy(box, 2), position)
    assert listed_pairs(neighbors) == {(0, 1), (1, 0)}
    assert not neighbors.overflow


@each_box
def test_all_particles_in_one_cell(box):
    search = roomy(box, COUNT)
    jitter = 1e-3 * np.random.default_rng(0).uniform(-1.0, 1.0, (COUNT, box.dim))
    neighbors = build(search, jnp.asarray(search.grid.centers[-1] + jitter))
    assert len(listed_pairs(neighbors)) == COUNT * (COUNT - 1)
    assert not neighbors.overflow


# ------------------------------------------------------------------ capacities


@pytest.mark.parametrize("name", ["periodic", "narrow cube"])
@given(seed=seeds)
def test_rows_and_runs_that_are_too_full_are_flagged(name, seed):
    box, capacity, run_capacity = BOXES[name], 20, 16
    position = particles(box, seed)
    search = NeighborSearch(roomy(box, COUNT).grid, SUPPORT, SKIN, capacity, run_capacity)
    neighbors = build(search, jnp.asarray(position))
    full_run = longest_run(search.grid, position, position) > run_capacity
    distance = distances(box, position)
    np.fill_diagonal(distance, np.inf)
    assert np.abs(distance - RADIUS).min() > 1e-12  # a tie would leave the count open
    largest = (distance < RADIUS).sum(1).max()
    assert bool(neighbors.cell_overflow) == full_run
    assert bool(neighbors.overflow) == (full_run or largest > capacity)
    if not full_run:
        assert int(neighbors.largest_count) == largest
    assert np.all((neighbors.index >= 0) & (neighbors.index < COUNT)), "still safe to gather with"


@in_2d_and_3d
def test_allocation_fits_its_own_particles_exactly_and_agrees_with_a_tree(box):
    position = np.random.default_rng(1).uniform(box.lower, box.upper, (300, box.dim))
    search = NeighborSearch.allocate(jnp.asarray(position), box, SUPPORT, SKIN, margin=1.0)
    neighbors = build(search, jnp.asarray(position))
    assert not neighbors.overflow
    assert search.capacity == int(neighbors.largest_count)
    period = np.where(box.periodic, box.lengths, 0.0)  # 0: the tree's word for no period
    tree = cKDTree(position - np.asarray(box.lower), boxsize=period)
    expected = {pair for i, j in tree.query_pairs(RADIUS) for pair in ((i, j), (j, i))}
    assert listed_pairs(neighbors) == expected  # no tie at the radius with this seed


def test_capacities_are_chosen_while_a_derivative_is_taken():
    box, place = Box.unit_periodic(2), np.random.default_rng(2).uniform(size=(COUNT, 2))
    fixed = NeighborSearch.allocate(jnp.asarray(place), box, SUPPORT, SKIN)

    def moved(way):
        position = jnp.asarray(place) + way
        assert NeighborSearch.allocate(position, box, SUPPORT, SKIN) == fixed
        return jnp.sum(position)

    assert jax.grad(moved)(0.0) == 2 * COUNT


def test_a_place_that_is_not_finite_counts_as_nobody_s_neighbour():
    place = jnp.asarray([[0.1, 0.5], [jnp.nan, 0.5], [0.15, 0.5]])
    for box in (Box.unit_periodic(2), Box((0.0, 0.0), (1.0, 1.0), (CLOSED, CLOSED))):
        assert NeighborSearch.allocate(place, box, SUPPORT, SKIN).capacity == 2


@pytest.mark.parametrize("dim", [2, 3])
def test_box_too_small_for_the_support_raises(dim):
    position = jnp.zeros((1, dim))
    upper = (1.0,) * (dim - 1) + (1.99 * RADIUS,)
    with pytest.raises(ValueError, match="box: a periodic length of .* too small"):
        NeighborSearch.allocate(
            position, Box((0.0,) * dim, upper, (PERIODIC,) * dim), SUPPORT, SKIN
        )


def test_a_closed_box_may_be_smaller_than_the_support():
    box = Box((0.0, 0.0), (1.0, 0.5 * SUPPORT), (PERIODIC, CLOSED))  # no images across a wall
    search = NeighborSearch.allocate(jnp.zeros((1, 2)), box, SUPPORT, SKIN)
    assert search.grid.shape == (8, 1)


# ------------------------------------------------------------------ the skin


def test_largest_motion_is_measured_across_periodic_faces():
    box = BOXES["periodic"]
    position = jnp.asarray([[0.999, 0.0], [0.5, 0.0], [0.2, 0.49]])
    neighbors = build(roomy(box, 3), position)
    moved = box.wrap(position + jnp.asarray([[0.004, 0.0], [0.0, 0.001], [0.0, 0.02]]))
    distance, particle = neighbors.largest_motion(box, moved)
    assert distance == pytest.approx(0.02, rel=1e-12)  # round-off
    assert int(particle) == 2


@pytest.mark.parametrize("name", ["periodic", "cube"])
@settings(max_examples=20)
@given(seed=seeds)
def test_the_closest_pair_is_that_of_all_pairs(name, seed):
    box = BOXES[name]
    position = particles(box, seed)
    neighbors = build(roomy(box, COUNT), jnp.asarray(position))
    apart = distances(box, position)
    np.fill_diagonal(apart, np.inf)
    distance, particle = neighbors.closest(box, jnp.asarray(position))
    assert distance == pytest.approx(apart.min(), rel=1e-9)  # round-off
    assert apart[particle].min() == apart.min()


def test_one_particle_is_close_to_none():
    box = BOXES["periodic"]
    position = jnp.asarray([[0.5, 0.2]])
    assert np.isinf(build(roomy(box, 1), position).closest(box, position)[0])


@pytest.mark.parametrize("name", ["periodic", "cube"])
@settings(max_examples=20)
@given(seed=seeds)
def test_list_stays_complete_while_no_one_moves_more_than_half_the_skin(name, seed):
    box = BOXES[name]
    position = particles(box, seed)
    listed = listed_pairs(build(roomy(box, COUNT), jnp.asarray(position)))
    way = np.random.default_rng(seed).normal(size=position.shape)
    way *= 0.5 * SKIN / np.linalg.norm(way, axis=1, keepdims=True)
    distance = distances(box, position + way)
    np.fill_diagonal(distance, np.inf)
    within = set(zip(*map(np.ndarray.tolist, np.nonzero(distance < SUPPORT)), strict=True))
    assert within <= listed


def test_building_a_list_is_not_differentiated():
    box = BOXES["periodic"]
    search = roomy(box, COUNT)

    def via_list(x):
        return jnp.sum(build(search, x).reference)

    position = jnp.asarray(particles(box, 0))
    np.testing.assert_array_equal(jax.grad(via_list)(position), np.zeros_like(position))
