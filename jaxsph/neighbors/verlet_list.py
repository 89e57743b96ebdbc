"""The neighbour list with a Verlet skin, of fixed capacity, built from a cell grid inside jit."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Float, Int

from ..cloud import Cloud
from ..devices import Devices
from ..domain import Box
from ..exchange import Exchange, least
from ..parking import Parking, flowing
from .cell_grid import CellGrid
from .cell_runs import Sorted, count_bits, flags, longest_run, pick
from .rows_of_devices import RowsOfDevices

CAPACITY_MARGIN = 1.15  # room in the list over its need at the start; every slot costs time
RUN_MARGIN = 1.25  # the same for runs of cells
_ASKED = 20_000  # particles whose neighbours are counted before a run
_ROUNDED = 1e-6  # round-off of single precision in a distance


class VerletList(eqx.Module):
    """Neighbours of every particle, in cell-sorted order.

    Row k of `index` lists the sorted places of the neighbours of the particle at sorted place k;
    free slots point to k itself, whose separation is zero and so adds nothing to a pair sum.

    Where devices share the rows, there are rows up to equal shares, and entries are places in the
    window of the device that holds them, as `exchange` has it.

    `order` has the number of the particle at each sorted place, `inverse` the converse; none where
    the particles lie `in_place`.
    """

    index: Int[Array, "particles capacity"]
    order: Int[Array, " particles"]
    inverse: Int[Array, " particles"] | None
    reference: Float[Array, "particles dim"]
    largest_count: Int[Array, ""]
    cell_overflow: Int[Array, ""]
    exchange: Exchange | None = eqx.field(static=True, default=None)

    def sort(self, field: Array) -> Array:
        """A per-particle field in the list's cell-sorted order."""
        if self.inverse is None:
            return self.exchange.devices.divided(field)
        if self.exchange is not None:
            return self.exchange.devices.take(field, self.order)
        return field.at[self.order].get(mode="promise_in_bounds", unique_indices=True)

    def unsort(self, field: Array) -> Array:
        """A field in cell-sorted order back in the particles' own order."""
        if self.inverse is None:
            return self.exchange.devices.divided(field)
        if self.exchange is not None:
            return self.exchange.devices.take(field, self.inverse)
        return field.at[self.inverse].get(mode="promise_in_bounds", unique_indices=True)

    def in_place(self, number: Int[Array, " particles"] | None = None) -> VerletList:
        """The same list where the particles themselves are kept in its order: fields are sorted as
        they are. `number` are those that they had when the list was built, if not 0, 1, 2 ..."""
        order = self.order if number is None else number[self.order]
        return replace(self, order=order, inverse=None, reference=self.sort(self.reference))

    def by_number(self, field: Array) -> Array:
        """A field of particles that lie in place, by their numbers."""
        devices = self.exchange.devices
        return devices.take(field, _inverse(devices.whole(self.order)))

    def first(self, marked: Bool[Array, " particles"]) -> Int[Array, ""]:
        """The number of the first particle of those marked."""
        if self.inverse is not None:
            return jnp.argmax(marked)
        return jnp.min(jnp.where(marked, self.order, len(self.order)))

    def largest_motion(self, box: Box, position: Array) -> tuple[Array, Array]:
        """The longest way [m] that a particle has gone since the list was built, and which one."""
        moved = box.displacement(self.reference, lax.stop_gradient(position))
        squared = jnp.sum(moved * moved, axis=1)
        if self.inverse is None:
            largest = jnp.max(squared)
            return jnp.sqrt(largest), self.first(squared == largest)
        particle = jnp.argmax(squared)
        return jnp.sqrt(squared[particle]), particle

    def closest(self, box: Box, position: Array) -> tuple[Array, Array]:
        """The least distance [m] between two neighbours, and one of the two."""
        here = self.sort(lax.stop_gradient(position)).T
        index = self.index
        if self.exchange is not None:
            index = RowsOfDevices(self.exchange, index.shape[0]).whole(index)[: here.shape[1]]
        # axis by axis, so that no array of all pairs is made
        apart = (box.minimum_image(x[index] - x[:, None], k) for k, x in enumerate(here))
        squared = sum(along * along for along in apart)
        free = index == jnp.arange(here.shape[1], dtype=index.dtype)[:, None]
        nearest = jnp.min(jnp.where(free, jnp.inf, squared), axis=1)
        row = jnp.argmin(nearest)
        return jnp.sqrt(nearest[row]), self.order[row]

    @property
    def overflow(self) -> Array:
        """Whether a row or a run of cells had more than fits; the list is then not usable."""
        return (self.largest_count > self.index.shape[1]) | (self.cell_overflow > 0)


class NeighborSearch(eqx.Module):
    """Capacities and radii of a neighbour list; chosen outside jit, static inside it.

    Args:
        grid: cells at least half a search radius wide, with reach 2.
        support: radius of the kernel's support [m].
        skin: extra radius [m]; the list stays valid until a particle has moved half of it.
        capacity: neighbours a particle can have.
        run_capacity: particles that a run of cells can hold, as many as the search reaches over.
        depths: for each axis the particles that can be next to a device's own where cells are
            numbered along that axis first; none if that is not known.
        devices: that share the rows of the list, if several do.
        parking: where particles wait that take no part, if some do.
    """

    grid: CellGrid = eqx.field(static=True)
    support: float = eqx.field(static=True)
    skin: float = eqx.field(static=True)
    capacity: int = eqx.field(static=True)
    run_capacity: int = eqx.field(static=True)
    depths: tuple[int, ...] = eqx.field(static=True, default=())
    devices: Devices | None = eqx.field(static=True, default=None)
    parking: Parking | None = eqx.field(static=True, default=None)

    @classmethod
    def allocate(
        cls,
        position: Float[Array, "particles dim"],
        box: Box,
        support: float,
        skin: float,
        margin: float = CAPACITY_MARGIN,
        parking: Parking | None = None,
    ) -> NeighborSearch:
        """Choose capacities for particles near `position`, `margin` times what these need; those
        that are parked need none.

        Raises:
            ValueError: if a periodic box is too small for the support and its skin, or there is
                no particle.
        """
        if position.shape[0] == 0:
            raise ValueError("position: got no particles; give at least one.")
        radius, position = support + skin, lax.stop_gradient(position)
        particles = position.shape[0]
        position = flowing(position, parking)
        check_periodic(box, support, skin)
        grid = CellGrid.with_width(box, 0.5 * radius, reach=2)
        count = grid.counts(position)
        run_capacity = int(max(margin, RUN_MARGIN) * grid.longest_run(count, count)) + 2
        largest = most_around(box, position, position, radius) - 1  # itself is one
        capacity = max(8, int(np.ceil(margin * largest)))
        capacity = min(capacity, max(1, particles - 1))
        longways = (_along(grid, axis) for axis in range(box.dim))
        count = count.reshape(grid.shape)
        depths = (_rounded(margin * g.depth(count.transpose(axes).ravel())) for g, axes in longways)
        return cls(
            grid, support, skin, capacity, run_capacity, _Unread(depths), parking=parking
        )

    @property
    def box(self) -> Box:
        return self.grid.box

    def enlarged(self) -> NeighborSearch:
        """The same search with a fifth more room, and halos twice as deep: in a few times they
        are no less than all."""
        return replace(
            self,
            capacity=math.ceil(1.2 * self.capacity),
            run_capacity=math.ceil(1.2 * self.run_capacity),
            depths=self.depths if self.devices is None else tuple(2 * d for d in self.depths),
        )

    def exchange(self, particles: int) -> Exchange:
        """How its devices exchange what they know of so many particles."""
        # the last device's run may be short by as many rows as there are devices
        depth = min(self.depths, default=particles) + self.devices.count
        return least(self.devices, particles, depth)

    def over(self, devices: Devices) -> NeighborSearch:
        """The same search by several devices."""
        return replace(self, devices=devices, depths=tuple(self.depths))

    def largest_motion(self, neighbors: VerletList, position: Array) -> tuple[Array, Array]:
        """The longest way [m] that a particle has gone since the list was built, and which one."""
        return neighbors.largest_motion(self.box, position)

    def build(self, position: Float[Array, "particles dim"]) -> VerletList:
        """The list of all neighbours within support + skin of each, in jit or out of it."""
        return _built(self, position)


class _Unread(tuple):
    """Numbers that a single device does not read: programs that differ in them are the same."""

    def __eq__(self, other):
        return isinstance(other, tuple)

    def __hash__(self):
        return 0


def _along(grid: CellGrid, axis: int) -> tuple[CellGrid, np.ndarray]:
    """The same cells numbered along one axis first, and the columns of positions in it."""
    axes = (axis, *(k for k in range(grid.box.dim) if k != axis))
    return grid.along(axes), np.asarray(axes)


def _rounded(number: float) -> int:
    """Up to two digits, so that scenes alike have programs alike."""
    last = 10 ** max(0, math.floor(math.log10(max(1.0, number))) - 1)
    return math.ceil(number / last) * last


def _inverse(order: Int[Array, " particles"]) -> Int[Array, " particles"]:
    places = jnp.arange(len(order), dtype=order.dtype)
    return jnp.zeros_like(order).at[order].set(places, unique_indices=True)


def most_around(
    box: Box, points: Float[Array, "points dim"], places: Float[Array, "places dim"], radius: float
) -> int:
    """The most points within a radius of a place, of those that are finite (a run names the rest).

    Of many places some are asked: a run that finds its list too short makes it anew.
    """
    points, places = (x[np.isfinite(x).all(axis=1)] for x in map(np.asarray, (points, places)))
    asked = places[:: 1 + len(places) // _ASKED]
    radius = radius * (1.0 + _ROUNDED)  # single precision may see a tie there as nearer
    return int(Cloud(points, box).count_around(asked, radius).max(initial=0))


def check_periodic(box: Box, support: float, skin: float = 0.0) -> None:
    """A ValueError if a particle could meet another across two faces of a periodic box."""
    radius = support + skin
    for length, periodic in zip(box.lengths, box.periodic, strict=True):
        if periodic and length < 2.0 * radius:
            raise ValueError(
                f"box: a periodic length of {length:g} m is too small for a kernel support of "
                f"{support:g} m (with skin {radius:g} m); it needs at least {2 * radius:g} m. "
                "Raise the resolution or lower h/dx."
            )


@partial(eqx.filter_jit, inline=True)  # one program, where a caller has none of its own
def _built(search: NeighborSearch, position) -> VerletList:
    position = lax.stop_gradient(position)
    grid, room = search.grid, (search.run_capacity, search.capacity)
    taking_part = None if search.parking is None else ~search.parking.holds(position)
    if search.devices is None:
        points = Sorted.of(grid, position, taking_part)
        words = flags(grid, points, points, search.support + search.skin, search.run_capacity)
        largest = jnp.max(count_bits(words))
        longest = longest_run(grid, points, points)
        places = jnp.arange(points.count, dtype=jnp.int32)
        index = pick(words, grid, points, points, *room)
        exchange = None
    else:
        devices, exchange = search.devices, search.exchange(position.shape[0])
        grid, columns = _along(grid, int(np.argmin(search.depths or (0,))))
        position = devices.whole(position)  # each device sorts all
        points = devices.whole(Sorted.of(grid, position[:, columns], taking_part))
        radius = search.support + search.skin
        places = jnp.arange(points.count, dtype=jnp.int32)
        rows = RowsOfDevices.of(exchange, points.count)
        index, largest, longest, unseen = rows.listed(grid, points, points, radius, *room)
        longest = jnp.where(unseen, search.run_capacity + 1, longest)  # has no room either
    return VerletList(
        index=index,
        order=points.order,
        inverse=jnp.zeros_like(places).at[points.order].set(places, unique_indices=True),
        reference=position,
        largest_count=largest,
        cell_overflow=(longest > search.run_capacity).astype(jnp.int32),
        exchange=exchange,
    )
