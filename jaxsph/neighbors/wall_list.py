"""Neighbour lists of a fluid with walls: among its particles, and between these and the ghosts."""

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
from ..exchange import Exchange, Gathered
from ..parking import Parking, flowing
from .cell_grid import CellGrid
from .cell_runs import Sorted, count_bits, flags, longest_run, pick
from .rows_of_devices import RowsOfDevices
from .verlet_list import CAPACITY_MARGIN, RUN_MARGIN, NeighborSearch, VerletList, most_around

_FILLED = 0.7  # share of the places near walls that a vessel full of fluid takes, at least


class WallPairs(eqx.Module):
    """Pairs of a fluid particle and a ghost.

    Rows 0 to W - 1 of `index` belong to the W particles listed in `near`, all others to the ghosts
    listed in `ghosts`; entries are row numbers. Each pair stands in both rows.

    Where devices share the rows, each has first its rows of particles, then those of ghosts, and
    entries are as in a `VerletList`. Rows up to equal shares have no partner: their `near` is past
    the last particle, their ghost is the last one once more.

    Args:
        index: neighbours of each row; a free slot holds the row's own number.
        near: places, in the fluid list's sorted order, of the particles that may see a wall.
        ghosts: numbers of the ghosts.
    """

    index: Int[Array, "rows capacity"]
    near: Int[Array, " near"]
    ghosts: Int[Array, " ghosts"]
    exchange: Exchange | None = eqx.field(static=True, default=None)

    @property
    def fluid_rows(self) -> tuple[int, int]:
        """The first and the one past the last, of each device."""
        return 0, self.near.shape[0] // self._shares

    @property
    def ghost_rows(self) -> tuple[int, int]:
        """The first and the one past the last, of each device."""
        return self.fluid_rows[1], self.index.shape[0] // self._shares

    @property
    def _shares(self) -> int:
        return 1 if self.exchange is None else self.exchange.devices.count

    def of_near(self, field: Array) -> Array:
        """A field of the particles, in the fluid list's sorted order, at those near walls."""
        if self.exchange is None:
            return field.at[self.near].get(mode="promise_in_bounds", unique_indices=True)
        return self.exchange.devices.rows_for_all(field, self.near)

    def spread(self, values: Array, count: int) -> Array:
        """Values of the particles near walls as a field of all `count`, zero elsewhere."""
        if self.exchange is None:
            everywhere = jnp.zeros((count, *values.shape[1:]), values.dtype)
            return everywhere.at[self.near].set(values, unique_indices=True)
        return self.exchange.devices.rows_of_all(values, self.near, count)

    def table(self, near: Array, ghosts: Array) -> Array:
        """A field of all rows, of that of the particles near walls and that of the ghosts."""
        if self.exchange is None:
            return jnp.concatenate([near, ghosts])
        return self.exchange.devices.beside(near, ghosts)

    def only(self, held: Bool[Array, " all_ghosts"]) -> WallPairs:
        """The pairs with those ghosts alone, by their numbers."""
        particles = jnp.ones(self.near.shape, bool)
        row = self.table(particles, held[self.ghosts])
        own = jnp.arange(row.shape[0], dtype=self.index.dtype)[:, None]
        if self.exchange is None:
            return replace(self, index=jnp.where(row[self.index] & row[:, None], self.index, own))
        rows = RowsOfDevices(self.exchange, row.shape[0])
        partner = row[rows.whole(self.index)]
        own = rows.counted(own)
        return replace(self, index=jnp.where(partner & row[:, None], self.index, own))


class WallList(eqx.Module):
    """The Verlet list of the fluid, and the pairs that it makes with ghosts.

    `ghosts` is where these were when the list was built, if they move.
    """

    fluid: VerletList
    wall: WallPairs
    crowded: Bool[Array, ""]
    ghosts: Float[Array, "ghosts dim"] | None = None

    def sort(self, field: Array) -> Array:
        """A per-particle field in the fluid list's cell-sorted order."""
        return self.fluid.sort(field)

    def unsort(self, field: Array) -> Array:
        """A field in cell-sorted order back in the particles' own order."""
        return self.fluid.unsort(field)

    def in_place(self, number: Int[Array, " particles"] | None = None) -> WallList:
        """The same list where the particles themselves are kept in its order."""
        return replace(self, fluid=self.fluid.in_place(number))

    def by_number(self, field: Array) -> Array:
        """A field of particles that lie in place, by their numbers."""
        return self.fluid.by_number(field)

    def first(self, marked: Bool[Array, " particles"]) -> Int[Array, ""]:
        """The number of the first particle of those marked."""
        return self.fluid.first(marked)

    def largest_motion(self, box: Box, position: Array) -> tuple[Array, Array]:
        """The longest way [m] that a particle has gone since the list was built, and which one."""
        return self.fluid.largest_motion(box, position)

    def closest(self, box: Box, position: Array) -> tuple[Array, Array]:
        """The least distance [m] between two particles of the fluid, and one of the two."""
        return self.fluid.closest(box, position)

    @property
    def reference(self) -> Float[Array, "particles dim"]:
        return self.fluid.reference

    @property
    def order(self) -> Int[Array, " particles"]:
        return self.fluid.order

    @property
    def exchange(self) -> Exchange | None:
        return self.fluid.exchange

    @property
    def overflow(self) -> Array:
        """Whether a row, a run of cells or the number of particles near walls exceeds its room."""
        return self.fluid.overflow | self.crowded


class WalledSearch(eqx.Module):
    """Search for the neighbours of fluid particles among themselves and among ghosts.

    Only particles that may come within reach of a ghost have rows in the list of wall pairs; the
    cells of `reach_grid` marked in `within_reach` tell which. Where ghosts move, these are the
    particles with a ghost in the cells of `wall_grid` around their own.

    Args:
        fluid: search among the fluid's particles.
        ghosts: positions of the ghosts (G, n) [m].
        within_reach: marks of cells from which a ghost can be seen; None where ghosts move.
        reach_grid: cells about half a spacing wide.
        wall_grid: cells over the fluid's box and its ghosts.
        near_capacity: particles that can be near a wall.
        capacity: partners a particle or a ghost can have across the wall.
        near_run_capacity, ghost_run_capacity: of each kind in a run of cells.
    """

    fluid: NeighborSearch
    ghosts: Float[Array, "ghosts dim"]
    within_reach: Bool[Array, " cells"] | None
    reach_grid: CellGrid = eqx.field(static=True)
    wall_grid: CellGrid = eqx.field(static=True)
    near_capacity: int = eqx.field(static=True)
    capacity: int = eqx.field(static=True)
    near_run_capacity: int = eqx.field(static=True)
    ghost_run_capacity: int = eqx.field(static=True)

    @classmethod
    def allocate(
        cls,
        position: Float[Array, "particles dim"],
        ghosts: Float[Array, "ghosts dim"],
        box: Box,
        support: float,
        skin: float,
        spacing: float,
        margin: float = CAPACITY_MARGIN,
        moving: bool = False,
        parking: Parking | None = None,
    ) -> WalledSearch:
        """Choose capacities for particles near `position`, `margin` times what these need.

        `moving` tells whether the ghosts will be elsewhere when lists are built.

        Raises:
            ValueError: as `NeighborSearch.allocate`.
        """
        position = lax.stop_gradient(position)
        fluid = NeighborSearch.allocate(position, box, support, skin, margin, parking)
        particles = position.shape[0]
        position = flowing(position, parking)
        radius = support + skin
        reach_grid = CellGrid.with_width(box, 0.5 * spacing, reach=0)
        distance = Cloud(ghosts, box).nearest(reach_grid.centers)[0]
        half_diagonal = 0.5 * math.hypot(*reach_grid.widths)
        within_reach = jnp.asarray(distance < radius + half_diagonal)
        wall_grid = CellGrid.with_width(_around(box, radius), 0.5 * radius, reach=2)
        whole = cls(
            fluid,
            ghosts,
            None if moving else within_reach,
            reach_grid,
            wall_grid,
            particles,
            1,
            1,
            1,
        )
        near = np.asarray(whole._may_see(jnp.asarray(reach_grid.centers, position.dtype)))
        free = near & (distance > 0.72 * spacing)  # between ghosts is no room
        room = int(free.sum() * np.prod(reach_grid.widths) / spacing**box.dim)
        near = np.asarray(whole._may_see(position))
        of_fluid, of_ghosts = wall_grid.counts(position, near), wall_grid.counts(ghosts)
        near = np.asarray(position)[near]
        count = room if len(near) < _FILLED * room else len(near)  # fluid may flow there yet
        near_run = wall_grid.longest_run(of_ghosts, of_fluid)
        there = wall_grid.counts(jnp.asarray(reach_grid.centers, position.dtype), free)
        ghost_run = wall_grid.longest_run(of_fluid + there, of_ghosts)  # wherever fluid may come
        more = max(margin, RUN_MARGIN) if moving else 1.0
        largest = max(
            most_around(box, ghosts, near, radius), most_around(box, near, ghosts, radius)
        )
        return replace(
            whole,
            near_capacity=min(particles, int(np.ceil(margin * count)) + 1),
            capacity=max(8, int(np.ceil(margin * largest))),
            near_run_capacity=int(max(margin, RUN_MARGIN) * near_run) + 2,
            ghost_run_capacity=max(1, math.ceil(more * ghost_run) + (2 if moving else 0)),
        )

    @property
    def skin(self) -> float:
        return self.fluid.skin

    @property
    def box(self) -> Box:
        return self.fluid.box

    @property
    def devices(self) -> Devices | None:
        return self.fluid.devices

    @property
    def parking(self) -> Parking | None:
        return self.fluid.parking

    def enlarged(self) -> WalledSearch:
        """The same search with a fifth more room."""
        more = 1.0 if self.within_reach is not None else 1.2  # only ghosts that move may crowd
        return replace(
            self,
            fluid=self.fluid.enlarged(),
            near_capacity=math.ceil(1.2 * self.near_capacity),
            capacity=math.ceil(1.2 * self.capacity),
            near_run_capacity=math.ceil(1.2 * self.near_run_capacity),
            ghost_run_capacity=math.ceil(more * self.ghost_run_capacity),
        )

    def over(self, devices: Devices) -> WalledSearch:
        """The same search by several devices."""
        return replace(self, fluid=self.fluid.over(devices))

    def moved(self, ghosts: Float[Array, "ghosts dim"]) -> WalledSearch:
        """The same search with its ghosts elsewhere [m]."""
        return replace(self, ghosts=lax.stop_gradient(ghosts))

    def largest_motion(self, neighbors: WallList, position: Array) -> tuple[Array, Array]:
        """The longest way [m] that a particle or a ghost has gone since the list was built, and
        which particle, -1 for a ghost."""
        way, particle = neighbors.largest_motion(self.box, position)
        if neighbors.ghosts is None:
            return way, particle
        ghost_way = self.box.displacement(neighbors.ghosts, self.ghosts)
        ghost_way = jnp.sqrt(jnp.max(jnp.sum(ghost_way * ghost_way, axis=1)))
        return jnp.maximum(way, ghost_way), jnp.where(way >= ghost_way, particle, -1)

    def build(self, position: Float[Array, "particles dim"]) -> WallList:
        """All pairs within support + skin, of two particles or of a particle and a ghost."""
        return _built(self, position)

    @partial(eqx.filter_jit, inline=True)
    def _may_see(self, position) -> Bool[Array, " points"]:
        """Whether a ghost may be within support + skin of each point."""
        seeing = self._sees_there(position)
        return seeing if self.parking is None else seeing & ~self.parking.holds(position)

    def _sees_there(self, position) -> Bool[Array, " points"]:
        if self.within_reach is not None:
            return self.within_reach[self.reach_grid.locate(position)]
        grid = self.wall_grid
        held = jnp.zeros(grid.cells + 1, bool).at[grid.locate(self.ghosts)].set(True)
        return jnp.any(held[grid.stencil], axis=1)[grid.locate(position)]

    def _sorted(self, position) -> tuple[Sorted, Sorted, Array]:
        """Particles near walls and ghosts, each in the order of cells, and whether all fit."""
        within = self._may_see(position)
        # particles that are not near fill the rows left over: real ones, which see no ghost
        near = jnp.argsort(~within, stable=True)[: self.near_capacity].astype(jnp.int32)
        here = Sorted.of(self.wall_grid, position[near], within[near])
        here = replace(here, order=near[here.order])
        return here, Sorted.of(self.wall_grid, self.ghosts), jnp.sum(within) > near.shape[0]

    def _flag(self, position):
        """Near particles and ghosts, and the flags of each among the other."""
        grid, radius = self.wall_grid, self.fluid.support + self.skin
        here, ghosts, overflow = self._sorted(position)
        largest, sides = jnp.zeros((), jnp.int32), []
        for points, others, room in (
            (here, ghosts, self.ghost_run_capacity),
            (ghosts, here, self.near_run_capacity),
        ):
            words = flags(grid, points, others, radius, room)
            largest = jnp.maximum(largest, jnp.max(count_bits(words)))
            overflow = overflow | (longest_run(grid, points, others) > room)
            sides.append(words)
        return here, ghosts, sides, overflow | (largest > self.capacity)


def _around(box: Box, margin: float) -> Box:
    """The box, wider by a margin [m] at its closed faces."""
    return Box(
        tuple(a if p else a - margin for a, p in zip(box.lower, box.periodic, strict=True)),
        tuple(b if p else b + margin for b, p in zip(box.upper, box.periodic, strict=True)),
        box.periodic,
    )


@partial(eqx.filter_jit, inline=True)
def _built(search: WalledSearch, position) -> WallList:
    position = lax.stop_gradient(position)
    fluid = search.fluid.build(position)
    built_at = search.ghosts if search.within_reach is None else None
    if search.devices is not None:
        position = search.devices.whole(position)[fluid.order]
        pairs, overflow = _shared_pairs(search, position)
        return WallList(fluid, pairs, overflow, built_at)
    here, ghosts, (seen, seeing), overflow = search._flag(fluid.sort(position))
    grid, near, count = search.wall_grid, here.order, here.count
    to_ghosts, to_fluid = search.ghost_run_capacity, search.near_run_capacity
    index = jnp.concatenate([
        pick(seen, grid, here, ghosts, to_ghosts, search.capacity, entry=count),
        pick(seeing, grid, ghosts, here, to_fluid, search.capacity, own=count),
    ])  # fmt: skip
    return WallList(fluid, WallPairs(index, near, ghosts.order), overflow, built_at)


def _shared_pairs(search: WalledSearch, position) -> tuple[WallPairs, Bool[Array, ""]]:
    """Each device's rows of the pairs, and whether there is no room for all."""
    devices, grid, count = search.devices, search.wall_grid, position.shape[0]
    exchange = Gathered(devices)  # of a surface's particles and ghosts alone
    here, ghosts, overflow = devices.whole(search._sorted(position))
    rows, sides = RowsOfDevices.of(exchange, here.count, ghosts.count), []
    for points, others, room, second in (
        (here, ghosts, search.ghost_run_capacity, False),
        (ghosts, here, search.near_run_capacity, True),
    ):
        index, most, longest, _ = rows.listed(
            grid, points, others, search.fluid.support + search.skin, room, search.capacity, second
        )
        overflow = overflow | (most > search.capacity) | (longest > room)
        sides.append(index)
    near = devices.whole(devices.filled(here.order, count))  # read in every pass
    number = devices.filled(ghosts.order, ghosts.order[-1])
    return WallPairs(devices.beside(*sides), near, number, exchange), overflow
