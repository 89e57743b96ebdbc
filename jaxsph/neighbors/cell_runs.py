"""Which points are near which, read off runs of cells: each row of cells is one run of memory."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float, Int, UInt32

from ..chunks import wide_map
from .cell_grid import CellGrid, stencil

BITS = 32  # of a word in which candidates are flagged
_LANES = 8  # bits come in such numbers, for the vector unit
_PAIRS = 4_000_000  # candidates looked at in one go
_SLOTS = 120_000  # of the list, filled in one go


class Sorted(eqx.Module):
    """Points in the order of their cells.

    Args:
        order: numbers of the points.
        cell: of each; those past the last cell take no part.
        edges: where each cell begins, and one row of cells beyond the last.
        position: of the points, in that order [m].
    """

    order: Int[Array, " points"]
    cell: Int[Array, " points"]
    edges: Int[Array, " edges"]
    position: Float[Array, "points dim"]

    @classmethod
    def of(cls, grid: CellGrid, position: Float[Array, "points dim"], taking_part=None) -> Sorted:
        cell = grid.locate(position)
        if taking_part is not None:
            cell = jnp.where(taking_part, cell, grid.cells)
        order, cell, edges = grid.sort(cell)
        edges = jnp.pad(edges[:-1], (0, grid.shape[-1]), mode="edge")
        return cls(order, cell, edges, position[order])

    @property
    def count(self) -> int:
        return self.order.shape[0]


class Runs(eqx.Module):
    """The points in the cells around some cells: in each row of cells, one run of sorted places.

    A run that crosses a periodic face goes on at the start of its row.
    """

    start: Int[Array, "cells rows"]
    length: Int[Array, "cells rows"]
    row_end: Int[Array, "cells rows"]
    row_length: Int[Array, "cells rows"]

    @classmethod
    def around(cls, grid: CellGrid, points: Sorted, cell: Int[Array, " cells"]) -> Runs:
        """Those around each cell; empty around cells past the last."""
        n, reach, edges = grid.shape[-1], grid.reach, points.edges
        rows = grid.cells // n
        beside = jnp.asarray(stencil(grid.shape[:-1], grid.box.periodic[:-1], reach))
        beside = jnp.concatenate([beside, jnp.full((1, beside.shape[1]), rows, jnp.int32)])
        row, column = beside[cell // n] * n, (cell % n)[:, None]
        row_start, row_end = edges[row], edges[row + n]
        if not grid.box.periodic[-1]:
            first, last = jnp.maximum(column - reach, 0), jnp.minimum(column + reach, n - 1)
            start = edges[row + first]
            length = edges[row + last + 1] - start
        elif n <= 2 * reach:  # the run would meet itself: each cell counts once
            start, length = row_start, row_end - row_start
        else:
            first, last = (column - reach) % n, (column + reach) % n
            start = edges[row + first]
            length = edges[row + last + 1] - start
            length = length + jnp.where(first > last, row_end - row_start, 0)
        return cls(start, length, row_end, row_end - row_start)


def words_of(capacity: int) -> tuple[int, int]:
    """Words for each run of up to `capacity` points, and bits used of each."""
    words = -(-capacity // BITS)
    return words, -(-capacity // (words * _LANES)) * _LANES


def flags(
    grid: CellGrid,
    here: Sorted,
    there: Sorted,
    radius: float,
    capacity: int,
    places: Int[Array, " points"] | None = None,
) -> UInt32[Array, "points words"]:
    """For each point `here` a bit for each point `there` in the cells around: within the radius?

    A run is read as it lies in memory, no point of it is looked up by its number. A point is no
    neighbour of its own, where both are the same, or where its place `there` is given.
    """
    words, bits = words_of(capacity)
    number = jnp.arange(words * bits, dtype=jnp.int32)[None, None, :]
    columns = [
        jnp.pad(there.position[:, axis], number.size, constant_values=jnp.nan)
        for axis in range(grid.box.dim)
    ]

    def read(column, start):
        return _windows(column, start + number.size, number.size)

    def some(block):
        mine, place, cell = block
        runs = Runs.around(grid, there, cell)
        first = runs.row_end - runs.start  # of the run, before it crosses a periodic face
        back = runs.start - runs.row_length
        near = number < runs.length[:, :, None]
        squared = jnp.zeros((), mine.dtype)
        for axis, column in enumerate(columns):
            other = read(column, runs.start)
            if grid.box.periodic[-1]:
                other = jnp.where(number < first[:, :, None], other, read(column, back))
            separation = other - mine[:, axis, None, None]
            squared = squared + grid.box.minimum_image(separation, axis) ** 2
        near = near & (squared < radius**2)
        if same:
            start = runs.start[:, :, None]
            if grid.box.periodic[-1]:
                start = jnp.where(number < first[:, :, None], start, back[:, :, None])
            near = near & (start + number != place[:, None, None])
        return _pack(near.reshape(near.shape[0], -1, bits))

    same = here is there or places is not None
    if places is None:
        places = jnp.arange(here.count, dtype=jnp.int32)
    rows = (here.position, places, here.cell)
    around = stencil(grid.shape[:-1], grid.box.periodic[:-1], grid.reach).shape[1]
    return wide_map(some, rows, max(1, _PAIRS // (around * number.size)))


def _windows(column, start, size: int):
    """Stretches of a column of equal size, each from its start."""
    dimensions = lax.GatherDimensionNumbers((start.ndim,), (), (0,))
    mode = lax.GatherScatterMode.PROMISE_IN_BOUNDS
    return lax.gather(column, start[..., None], dimensions, (size,), mode=mode)


def longest_run(grid: CellGrid, here: Sorted, there: Sorted) -> Int[Array, ""]:
    """Points of the longest run that a point `here` looks at."""
    return jnp.max(Runs.around(grid, there, here.cell).length)


def _pack(flags):
    shift = jnp.arange(flags.shape[-1], dtype=jnp.uint32).reshape((1,) * (flags.ndim - 1) + (-1,))
    return jnp.sum(flags.astype(jnp.uint32) << shift, axis=-1, dtype=jnp.uint32)


def count_bits(words: UInt32[Array, "rows words"]) -> Int[Array, " rows"]:
    """Number of set bits of each row."""
    return jnp.sum(lax.population_count(words), axis=1, dtype=jnp.uint32).astype(jnp.int32)


def pick(
    words: UInt32[Array, "rows words"],
    grid: CellGrid,
    here: Sorted,
    there: Sorted,
    run_capacity: int,
    capacity: int,
    own: int = 0,
    entry: int = 0,
) -> Int[Array, "rows capacity"]:
    """Each row's bits as a list: slot k holds the point of the k-th set bit.

    A free slot holds the row's own number. Row numbers count from `own`, entries from `entry`.
    """
    each, bits = words_of(run_capacity)
    count = words.shape[1]
    slots = jnp.arange(capacity, dtype=jnp.int32)[None, :]

    def rows(block):
        words, cell, row = block
        runs = Runs.around(grid, there, cell)
        through_bytes = _through_bytes(words)
        through = jnp.cumsum((through_bytes >> 24).astype(jnp.int32), axis=1, dtype=jnp.int32)
        of_row = lax.optimization_barrier((words, through_bytes, through, runs))
        words, through_bytes, through, runs = of_row  # made once for all slots

        def of(k):
            start = runs.start[:, k // each] + (k % each) * bits
            of_run = (runs.row_end[:, k // each], runs.row_length[:, k // each])
            before = through[:, k - 1] if k else jnp.zeros_like(start)
            found = words[:, k], through_bytes[:, k], before, start, *of_run
            return tuple(a[:, None] for a in found)

        chosen = tuple(jnp.broadcast_to(a, (words.shape[0], capacity)) for a in of(0))
        for k in range(1, count):
            here_on = through[:, k - 1 : k] <= slots
            chosen = tuple(jnp.where(here_on, a, b) for a, b in zip(of(k), chosen, strict=True))
        word, through_word, before, start, row_end, row_length = chosen
        place = start + _select(word, through_word, (slots - before).astype(jnp.uint32))
        if grid.box.periodic[-1]:
            place = jnp.where(place >= row_end, place - row_length, place)
        return jnp.where(slots < through[:, -1:], place + entry, row[:, None])

    row = own + jnp.arange(words.shape[0], dtype=jnp.int32)
    return wide_map(rows, (words, here.cell, row), max(1, _SLOTS // capacity))


def _through_bytes(words):
    """How many bits are set in the lowest byte, in the lowest two, three and four of them."""
    pairs = words - ((words >> 1) & 0x55555555)
    fours = (pairs & 0x33333333) + ((pairs >> 2) & 0x33333333)
    return ((fours + (fours >> 4)) & 0x0F0F0F0F) * 0x01010101


def _select(word, through, rank):
    """Place of the rank-th set bit of a word."""
    byte = sum((((through >> (8 * k)) & 255) <= rank).astype(jnp.uint32) for k in range(3))
    rank = rank - (((through << 8) >> (8 * byte)) & 255)
    bit = 8 * byte
    for half in (4, 2, 1):
        low = (word >> bit) & ((1 << half) - 1)
        below = lax.population_count(low)
        upper = rank >= below
        rank = jnp.where(upper, rank - below, rank)
        bit = jnp.where(upper, bit + half, bit)
    return bit.astype(jnp.int32)
