"""The list of wall pairs holds exactly the pairs of a particle and a ghost within its radius."""

from dataclasses import replace
from functools import lru_cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from jaxsph import Box, CellGrid, NeighborSearch, WalledSearch
from tests.neighbors.longest_run import longest_run

CLOSED, PERIODIC = False, True
SPACING, SUPPORT, SKIN = 0.1, 0.2, 0.03
RADIUS = SUPPORT + SKIN
COUNT = 30
BOXES = {
    "closed": Box((0.0, -1.0), (1.0, 0.0), (CLOSED, CLOSED)),
    "channel": Box((0.0, -0.3), (0.5, 0.6), (PERIODIC, CLOSED)),  # 4 x 12 cells, periodic in 4
    "closed cube": Box((0.0, 0.0, -1.0), (0.4, 0.5, -0.6), (CLOSED,) * 3),
    "square pipe": Box((0.0,) * 3, (0.5, 0.3, 0.4), (PERIODIC, CLOSED, CLOSED)),
}
each_box = pytest.mark.parametrize(
    "box",
    [
        pytest.param(box, id=name, marks=[pytest.mark.slow] * (name == "closed cube"))
        for name, box in BOXES.items()
    ],
)
in_2d_and_3d = pytest.mark.parametrize(
    "box", [BOXES["channel"], BOXES["square pipe"]], ids=["2d", "3d"]
)
seeds = st.integers(0, 2**32 - 1)


def ghosts_around(box, layers=2):
    """Lattice points in layers beyond the closed faces, each moved a little, in numpy."""
    axes = []
    for low, length, periodic in zip(box.lower, box.lengths, box.periodic, strict=True):
        count, more = round(length / SPACING), 0 if periodic else layers
        axes.append(low + (np.arange(-more, count + more) + 0.5) * SPACING)
    lattice = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, box.dim)
    inside = np.all((lattice > box.lower) & (lattice < box.upper), axis=1)
    jitter = np.random.default_rng(1).uniform(-0.01, 0.01, lattice.shape)  # so that nothing ties
    return (lattice + jitter)[~inside]


def particles(box, seed, beyond=0.0):
    """Uniform, clustered, coincident particles or on the faces; up to `beyond` lengths outside."""
    rng = np.random.default_rng(seed)
    unit = rng.uniform(-beyond, 1.0 + beyond, (COUNT, box.dim))
    kind = rng.integers(0, 5)
    if kind == 1:
        unit = np.mod(rng.uniform(size=box.dim) + rng.normal(0.0, 0.1, unit.shape), 1.0)
    elif kind == 2:
        unit = np.where(rng.random(unit.shape) < 0.4, rng.integers(0, 2, unit.shape), unit)
    elif kind == 3:
        unit = unit[rng.integers(0, 1 + COUNT // 4, COUNT)]
    return np.asarray(box.lower) + unit * np.asarray(box.lengths)


@lru_cache
def roomy(box):
    """A search that cannot overflow."""
    ghosts = ghosts_around(box)
    more = [0.0 if periodic else RADIUS for periodic in box.periodic]
    lower = tuple(a - m for a, m in zip(box.lower, more, strict=True))
    upper = tuple(b + m for b, m in zip(box.upper, more, strict=True))
    around = Box(lower, upper, box.periodic)
    wall_grid = CellGrid.with_width(around, 0.5 * RADIUS, reach=2)
    reach_grid = CellGrid.with_width(box, 0.5 * SPACING, reach=0)
    corner = 0.5 * np.linalg.norm(reach_grid.widths)
    within = (distances(box, reach_grid.centers, ghosts) < RADIUS + corner).any(1)
    grid = CellGrid.with_width(box, 0.5 * RADIUS, reach=2)
    return WalledSearch(
        fluid=NeighborSearch(grid, SUPPORT, SKIN, capacity=COUNT - 1, run_capacity=COUNT),
        ghosts=jnp.asarray(ghosts),
        within_reach=jnp.asarray(within),
        reach_grid=reach_grid,
        wall_grid=wall_grid,
        near_capacity=COUNT,
        capacity=max(COUNT, 2 * int((distances(box, ghosts, ghosts) < RADIUS).sum(1).max())),
        near_run_capacity=COUNT,
        ghost_run_capacity=len(ghosts),
    )


@jax.jit
def build(search, position):
    return search.build(position)


def distances(box, here, there):
    """All distances by the nearest of all images, in numpy."""
    difference = np.asarray(there)[None, :, :] - np.asarray(here)[:, None, :]
    length = np.where(box.periodic, box.lengths, np.inf)
    shift = np.where(box.periodic, box.lengths, 0.0) * np.round(difference / length)
    return np.sqrt(((difference - shift) ** 2).sum(-1))


def listed_pairs(neighbors):
    """The list as pairs (particle, ghost), with both kinds of rows checked on the way."""
    wall = neighbors.wall
    index, near, ghosts = (np.asarray(a) for a in (wall.index, wall.near, wall.ghosts))
    count = len(near)
    assert wall.fluid_rows == (0, count) and wall.ghost_rows == (count, count + len(ghosts))
    assert len(index) == count + len(ghosts)
    assert np.all((index >= 0) & (index < len(index))), "safe to gather with"
    assert len(np.unique(near)) == count and len(np.unique(ghosts)) == len(ghosts)
    own = np.arange(len(index))[:, None]
    free = index == own
    assert np.all(np.diff(free.astype(int), axis=1) >= 0), "free slots come last"
    row, slot = np.nonzero(~free)
    entry = index[row, slot]
    of_particle = row < count
    assert np.all((entry >= count) == of_particle), "a particle's partners are ghosts"
    number = np.asarray(neighbors.fluid.order)[near]
    seen = list(zip(number[row[of_particle]], ghosts[entry[of_particle] - count], strict=True))
    seeing = list(zip(number[entry[~of_particle]], ghosts[row[~of_particle] - count], strict=True))
    assert len(set(seen)) == len(seen) and len(set(seeing)) == len(seeing), "no partner twice"
    return set(seen), set(seeing)


def pairs_within(box, position, ghosts, radius):
    return set(zip(*np.nonzero(distances(box, position, ghosts) < radius), strict=True))


def check_complete(search, position, neighbors):
    seen, seeing = listed_pairs(neighbors)
    assert seen == seeing, "each pair stands in both rows"
    assert seen == pairs_within(search.box, position, search.ghosts, RADIUS)
    assert not neighbors.overflow


# ------------------------------------------------------------------ exactly the pairs in reach


@each_box
@settings(max_examples=25)
@given(seed=seeds)
def test_list_is_all_pairs_of_particle_and_ghost_within_the_radius(box, seed):
    position = particles(box, seed)
    search = roomy(box)
    check_complete(search, position, build(search, jnp.asarray(position)))


@each_box
@settings(max_examples=15)
@given(seed=seeds)
def test_particles_beyond_the_box(box, seed):
    # Within a step particles leave through periodic faces, and may pass a wall before it is found.
    position = particles(box, seed, beyond=0.3)
    search = roomy(box)
    check_complete(search, position, build(search, jnp.asarray(position)))


@in_2d_and_3d
@settings(max_examples=15)
@given(seed=seeds)
def test_list_stays_complete_while_no_one_moves_more_than_half_the_skin(box, seed):
    search = roomy(box)
    position = particles(box, seed)
    way = np.random.default_rng(seed).normal(size=position.shape)
    way *= 0.5 * SKIN / np.linalg.norm(way, axis=1, keepdims=True)
    neighbors = build(search, jnp.asarray(position))
    seen, seeing = listed_pairs(neighbors)
    within = pairs_within(box, position + way, search.ghosts, SUPPORT)
    assert within <= seen and within <= seeing
    motion, _ = neighbors.largest_motion(box, jnp.asarray(position + way))
    assert motion == pytest.approx(0.5 * SKIN, rel=1e-9)  # round-off of coordinates


@pytest.mark.slow
def test_single_precision():
    box = BOXES["channel"]
    search = roomy(box)
    single = replace(search, ghosts=search.ghosts.astype(jnp.float32))
    position = particles(box, 3).astype(np.float32)
    neighbors = build(single, jnp.asarray(position))
    assert neighbors.reference.dtype == jnp.float32
    seen, seeing = listed_pairs(neighbors)
    assert seen == seeing, "ties at the radius fall the same way in both rows"
    exact, ghosts = position.astype(float), np.asarray(single.ghosts, float)
    # 1e-6: coordinates and periods of order one are rounded to 6e-8, a few times
    assert pairs_within(box, exact, ghosts, RADIUS - 1e-6) <= seen
    assert seen <= pairs_within(box, exact, ghosts, RADIUS + 1e-6)


def test_the_fluid_has_its_own_complete_list():
    box = BOXES["channel"]
    position = particles(box, 1)
    neighbors = build(roomy(box), jnp.asarray(position))
    index, order = np.asarray(neighbors.fluid.index), np.asarray(neighbors.fluid.order)
    row, slot = np.nonzero(index != np.arange(COUNT)[:, None])
    found = set(zip(order[row], order[index[row, slot]], strict=True))
    exact = pairs_within(box, position, position, RADIUS) - {(k, k) for k in range(COUNT)}
    assert found == exact
    moved = neighbors.sort(jnp.asarray(position))
    np.testing.assert_array_equal(neighbors.unsort(moved), position)
    np.testing.assert_array_equal(neighbors.reference, position)


# ------------------------------------------------------------------ capacities


LIMITS = {  # one capacity below what random particles need
    "particles near walls": {"near_capacity": 12},
    "partners": {"capacity": 4},
    "ghosts in a run": {"ghost_run_capacity": 2},
    "particles in a run": {"near_run_capacity": 2},
}


@pytest.mark.parametrize("limit", LIMITS.values(), ids=LIMITS.keys())
@settings(max_examples=25)
@given(seed=seeds)
def test_what_does_not_fit_is_flagged_and_nothing_is_lost_in_silence(limit, seed):
    box = BOXES["channel"]
    search, position = replace(roomy(box), **limit), particles(box, seed)
    neighbors = build(search, jnp.asarray(position))
    near = np.asarray(search.within_reach[search.reach_grid.locate(jnp.asarray(position))])
    partners = distances(box, position, search.ghosts) < RADIUS
    grid = search.wall_grid
    full = {
        "near_capacity": near.sum(),
        "capacity": max(partners.sum(0).max(), partners.sum(1).max()),
        "near_run_capacity": longest_run(grid, search.ghosts, position[near]),
        "ghost_run_capacity": longest_run(grid, position[near], search.ghosts),
    }
    ((name, room),) = limit.items()
    assert bool(neighbors.overflow) == (full[name] > room)
    seen, seeing = listed_pairs(neighbors)  # still safe to gather with
    exact = pairs_within(box, position, search.ghosts, RADIUS)
    assert bool(neighbors.overflow) or seen == seeing == exact


def test_an_overflow_among_the_fluid_is_one_of_the_whole():
    box = BOXES["channel"]
    neighbors = build(roomy(box), jnp.asarray(particles(box, 0)))
    full = replace(neighbors.fluid, largest_count=jnp.asarray(COUNT, jnp.int32))
    assert not neighbors.overflow and replace(neighbors, fluid=full).overflow


def test_allocation_fits_a_lattice_exactly_and_gives_rows_near_walls_only():
    side, box = 20, Box((0.0, 0.0), (2.0, 2.0), (CLOSED, CLOSED))
    centres = (np.arange(side) + 0.5) * SPACING
    position = np.stack(np.meshgrid(centres, centres, indexing="ij"), -1).reshape(-1, 2)
    ghosts = jnp.asarray(ghosts_around(box))
    search = WalledSearch.allocate(jnp.asarray(position), ghosts, box, SUPPORT, SKIN, SPACING, 1.0)
    neighbors = build(search, jnp.asarray(position))
    check_complete(search, position, neighbors)
    partners = distances(box, position, ghosts) < RADIUS
    assert search.capacity == max(8, partners.sum(0).max(), partners.sum(1).max())
    # Of 20 layers of particles two are within 0.23 m of a ghost; marked cells may add a third.
    assert partners.any(1).sum() == side**2 - 16**2
    assert side**2 - 16**2 < neighbors.wall.near.shape[0] <= side**2 - 14**2 + 1
    larger = search.enlarged()
    assert larger.fluid.capacity > search.fluid.capacity
    for name in ("near_capacity", "capacity", "near_run_capacity"):
        assert getattr(larger, name) >= 1.2 * getattr(search, name)


@pytest.mark.parametrize("dim", [2, 3])
def test_box_too_small_for_the_support_raises(dim):
    box = Box((0.0,) * dim, (1.99 * RADIUS,) * dim, (PERIODIC,) + (CLOSED,) * (dim - 1))
    ghosts = jnp.asarray(ghosts_around(box))
    with pytest.raises(ValueError, match="box: a periodic length of .* too small"):
        WalledSearch.allocate(jnp.zeros((1, dim)), ghosts, box, SUPPORT, SKIN, SPACING)


def test_fluid_may_come_to_where_ghosts_are_denser():
    """More room in a list is room for them: no run of cells is known by the start alone."""
    box = Box((0.0, 0.0), (1.0, 2.0), (False, False))
    ticks = 0.05 * np.arange(-4, 0) + 0.025
    along = 0.05 * np.arange(-4, 24) + 0.025
    floor = np.stack(np.meshgrid(along, ticks, indexing="ij"), axis=-1).reshape(-1, 2)
    finer = 0.025 * np.arange(-8, 48) + 0.0125
    lid = np.stack(np.meshgrid(finer, 2.0 + 0.025 * np.arange(8) + 0.0125), axis=-1).reshape(-1, 2)
    ghosts = jnp.asarray(np.concatenate([floor, lid]))
    places = 0.05 * np.arange(20) + 0.025
    low = np.stack(np.meshgrid(places, places[:8], indexing="ij"), axis=-1).reshape(-1, 2)
    search = WalledSearch.allocate(jnp.asarray(low), ghosts, box, 0.2, 0.04, 0.05)
    high = jnp.asarray(low + np.array([[0.0, 1.6]]))
    for _ in range(12):
        search = search.enlarged()
    assert not bool(search.build(high).overflow)
