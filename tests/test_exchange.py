"""What a device sees of the rows of others: places, and whether all neighbours are among them."""

import dataclasses
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxsph
from jaxsph.domain import Box
from jaxsph.exchange import Gathered, Halo, least
from jaxsph.neighbors import NeighborSearch

BOX = Box((0.0, 0.0), (1.0, 1.0), (True, True))


@dataclass(frozen=True)
class Several:
    """So many devices as far as their shares go."""

    count: int

    def share(self, rows):
        return -(-rows // self.count)


@pytest.mark.parametrize("depth", [0, 1, 5, 7])
def test_places_in_a_window_are_places_of_all_and_back(depth):
    halo, rows = Halo(Several(4), depth), 20
    place, seen = halo.seen(jnp.arange(rows), rows)
    assert int(jnp.sum(seen)) == 5 + 2 * depth
    np.testing.assert_array_equal(np.sort(place[seen]), np.arange(5 + 2 * depth))
    np.testing.assert_array_equal(halo.among_all(place, rows)[seen], np.arange(rows)[seen])


def test_the_exchange_that_sends_less_is_taken():
    assert least(Several(8), 800, 349) == Halo(Several(8), 349)  # 698 of 700 rows
    assert least(Several(8), 800, 350) == Gathered(Several(8))
    assert least(Several(1), 800, 1) == Gathered(Several(1))  # which sends nothing


@pytest.mark.run_once
@pytest.mark.parametrize("periodic", [(True, True), (False, False)])
def test_halos_are_as_deep_as_neighbours_lie(periodic):
    """All neighbours of random particles, in a list made on one device, are in sight of four; not
    so in halos of a third of the depth."""
    box = Box((0.0, 0.0), (3.0, 1.0), periodic)
    random = np.random.default_rng(0)
    position = jnp.asarray(random.uniform(size=(603, 2)) * np.asarray([3.0, 1.0]))
    search = NeighborSearch.allocate(position, box, 0.1, 0.02)
    assert search.depths[0] < search.depths[1]  # slabs across the longer side are the thinner
    index = np.asarray(search.build(position).index)  # cells numbered along the first axis first
    devices = Several(4)
    share, rows = devices.share(603), 4 * devices.share(603)
    first = np.arange(603) // share * share
    place = jnp.asarray((index - first[:, None]) % rows)
    deep = search.depths[0] + devices.count
    assert bool(jnp.all(Halo(devices, deep).seen(place, rows)[1]))
    assert not bool(jnp.all(Halo(devices, deep // 3).seen(place, rows)[1]))


def test_halos_that_are_too_small_are_soon_all():
    """Water that spreads can need many times the halo it began with."""
    search = NeighborSearch.allocate(jnp.asarray([[0.5, 0.5]]), BOX, 0.1, 0.02)
    shared = dataclasses.replace(search.over(Several(4)), depths=(60, 80))
    assert isinstance(shared.exchange(2000), Halo)
    for _ in range(7):
        shared = shared.enlarged()
    assert isinstance(shared.exchange(2000), Gathered)


def test_one_device_does_not_compile_anew_for_other_halos():
    random = np.random.default_rng(1)
    side = np.arange(20) / 20 + 0.01
    even = jnp.asarray(np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2))
    moved = even + jnp.asarray(random.uniform(0.0, 0.02, (400, 2)))
    one, other = (NeighborSearch.allocate(x, BOX, 0.1, 0.02) for x in (even, moved))
    other = dataclasses.replace(other, capacity=one.capacity, run_capacity=one.run_capacity)
    assert tuple.__ne__(one.depths, other.depths)
    assert jax.tree.structure(one) == jax.tree.structure(other)
    assert jax.tree.structure(one.over(Several(2))) != jax.tree.structure(other.over(Several(2)))


@pytest.mark.run_once
def test_particles_kept_in_the_order_of_cells_are_given_back_in_their_own():
    scene = jaxsph.scenes.taylor_green(12)
    model = scene.model().over(jaxsph.Devices(jax.devices()[:1]))
    state, neighbors = model.begin(scene.state)
    assert bool(jnp.any(state.position != scene.state.position))
    for kept, own in zip(jax.tree.leaves(model.end(state, neighbors)),
                         jax.tree.leaves(scene.state), strict=True):  # fmt: skip
        np.testing.assert_array_equal(kept, own)
    marked = np.zeros(144, bool)
    marked[[40, 25, 99]] = True
    assert int(neighbors.first(marked[np.asarray(neighbors.order)])) == 25
