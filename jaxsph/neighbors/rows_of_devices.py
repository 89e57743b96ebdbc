"""Rows of a neighbour list that several devices share, each listing those of its own."""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp
from jaxtyping import Array, Bool, Int

from ..devices import Devices
from ..exchange import Exchange
from .cell_grid import CellGrid
from .cell_runs import Sorted, count_bits, flags, longest_run, pick


@dataclass(frozen=True)
class RowsOfDevices:
    """Where points of one or two kinds stand in a table whose rows devices share.

    Each device holds as many rows, `block`, first its points of one kind and then those of the
    other. Entries of a list are places in its window on the table, as `exchange` has it.
    """

    exchange: Exchange
    rows: int
    first_kind: int = 0  # rows of a device that are of the first of two kinds

    @classmethod
    def of(cls, exchange: Exchange, first: int, second: int = 0) -> RowsOfDevices:
        """For so many points of the first kind and of the second."""
        devices = exchange.devices
        shares = devices.share(first), devices.share(second)
        return cls(exchange, devices.count * sum(shares), shares[0] if second else 0)

    @property
    def devices(self) -> Devices:
        return self.exchange.devices

    @property
    def block(self) -> int:
        """Rows of a device."""
        return self.rows // self.devices.count

    def whole(self, index: Int[Array, "rows slots"]) -> Int[Array, "rows slots"]:
        """Entries of a list as they count from the table's first row."""
        first = jnp.arange(self.rows, dtype=index.dtype) // self.block * self.block
        return (self.exchange.among_all(index, self.rows) + first[:, None]) % self.rows

    def counted(self, index: Int[Array, "rows slots"]) -> Int[Array, "rows slots"]:
        """The converse."""
        first = jnp.arange(self.rows, dtype=index.dtype) // self.block * self.block
        return self.exchange.seen((index - first[:, None]) % self.rows, self.rows)[0]

    def listed(
        self,
        grid: CellGrid,
        here: Sorted,
        there: Sorted,
        radius: float,
        run_capacity: int,
        capacity: int,
        second: bool = False,
    ) -> tuple[Int[Array, "rows capacity"], Int[Array, ""], Int[Array, ""], Bool[Array, ""]]:
        """The list of the points `here` by those `there`, the most neighbours of one of them, the
        points of the longest run of cells that one looks at, and whether a device does not see one
        that it lists.

        Args:
            grid: of cells.
            here, there: points; if not the same, one of each kind.
            radius: within which two are neighbours [m].
            run_capacity: of a run of cells.
            capacity: of a row.
            second: whether those `here` are of the second kind.
        """
        devices, same = self.devices, here is there
        share, other = devices.share(here.count), devices.share(there.count)
        before, other_before = (self.first_kind, 0) if second else (0, self.first_kind)
        beyond = share * devices.count - here.count
        cell = jnp.pad(here.cell, (0, beyond), constant_values=grid.cells)  # that take no part
        position = jnp.pad(here.position, ((0, beyond), (0, 0)), mode="edge")

        def own(cell, position, there):
            number = jnp.arange(share, dtype=jnp.int32)
            place = devices.number() * share + number
            mine = Sorted(place, cell, there.edges, position)
            words = flags(grid, mine, there, radius, run_capacity, place if same else None)
            found = pick(words, grid, mine, there, run_capacity, capacity)
            row = found // other * self.block + other_before + found % other
            row = (row - devices.number() * self.block) % self.rows
            row, seen = self.exchange.seen(row, self.rows)
            count = count_bits(words)
            used = jnp.arange(capacity, dtype=jnp.int32)[None, :] < count[:, None]
            index = jnp.where(used, row, before + number[:, None])
            most = devices.largest(jnp.max(count))
            unseen = devices.largest(jnp.any(used & ~seen))
            return index, most, devices.largest(longest_run(grid, mine, there)), unseen

        return devices.each(own, (0, 0, None), (0, None, None, None))(cell, position, there)
