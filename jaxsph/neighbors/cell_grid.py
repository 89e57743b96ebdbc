"""A grid of equal cells over the box, each holding up to a fixed number of particles."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Float, Int

from ..domain import Box


class CellBins(eqx.Module):
    """Particles sorted into cells.

    `order[k]` is the particle at place k of the sorted order; `members[c]` are the sorted places
    in cell c, filled up with N; the row past the last cell is empty. `cell` and `slot` say for each
    sorted place where in `members` it stands.
    """

    order: Int[Array, " particles"]
    members: Int[Array, "cells_and_one capacity"]
    cell: Int[Array, " particles"]
    slot: Int[Array, " particles"]
    overflow: Bool[Array, ""]

    @property
    def inverse(self) -> Int[Array, " particles"]:
        """Each particle's place in the sorted order."""
        count = self.order.shape[0]
        places = jnp.arange(count, dtype=self.order.dtype)
        return jnp.zeros_like(self.order).at[self.order].set(places, unique_indices=True)


@dataclass(frozen=True)
class CellGrid:
    """A static grid of cells over a box (Viccione et al. 2008), for any dimension.

    Args:
        box: the domain.
        shape: cells per direction.
        reach: how many cells away, in each direction, a cell's neighbourhood extends.
    """

    box: Box
    shape: tuple[int, ...]
    reach: int = 1

    @classmethod
    def with_width(cls, box: Box, width: float, reach: int = 1) -> CellGrid:
        """The finest grid whose cells are at least `width` [m] wide."""
        return cls(box, tuple(max(1, int(length / width)) for length in box.lengths), reach)

    @property
    def cells(self) -> int:
        return int(np.prod(self.shape))

    @property
    def widths(self) -> tuple[float, ...]:
        return tuple(length / n for length, n in zip(self.box.lengths, self.shape, strict=True))

    @cached_property
    def stencil(self) -> np.ndarray:
        """(cells, neighbours): the cells around each cell, itself included, each cell once.

        The number `cells` stands for "outside the box".
        """
        return stencil(self.shape, self.box.periodic, self.reach)

    @cached_property
    def centers(self) -> np.ndarray:
        """(cells, dim) midpoints of the cells [m]."""
        index = np.indices(self.shape).reshape(len(self.shape), -1).T
        return np.asarray(self.box.lower) + (index + 0.5) * np.asarray(self.widths)

    @partial(jax.jit, static_argnums=0, inline=True)
    def locate(self, position: Float[Array, "points dim"]) -> Int[Array, " points"]:
        """The cell of each point; a point outside a closed box belongs to the nearest cell."""
        position = self.box.wrap(position)
        flat = jnp.zeros(position.shape[0], jnp.int32)
        for k, n in enumerate(self.shape):
            place = (position[:, k] - self.box.lower[k]) * (1.0 / self.widths[k])
            flat = flat * n + jnp.clip(place.astype(jnp.int32), 0, n - 1)
        return flat

    def along(self, axes: tuple[int, ...]) -> CellGrid:
        """The same cells, numbered along the axes in that order, the first one slowest; points have
        their coordinates in it."""
        lower, upper, periodic, shape = (
            tuple(of[k] for k in axes)
            for of in (self.box.lower, self.box.upper, self.box.periodic, self.shape)
        )
        return CellGrid(Box(lower, upper, periodic), shape, self.reach)

    def counts(
        self,
        position: Float[Array, "points dim"],
        taking_part: Bool[np.ndarray, " points"] | None = None,
    ) -> Int[np.ndarray, " cells"]:
        """How many points, of those that take part, are in each cell (outside jit, to choose
        capacities)."""
        cell = np.asarray(self.locate(position))
        return np.bincount(cell if taking_part is None else cell[taking_part], minlength=self.cells)

    def longest_run(
        self, here: Int[np.ndarray, " cells"], there: Int[np.ndarray, " cells"]
    ) -> int:
        """The most points `there` that a point `here` has in the cells around it that are in one
        row, both given by their counts (outside jit)."""
        n, reach = self.shape[-1], self.reach
        there = there.reshape(-1, n)
        if self.box.periodic[-1] and n <= 2 * reach:  # the run would meet itself
            runs = np.repeat(there.sum(axis=1, keepdims=True), n, axis=1)
        else:
            mode = "wrap" if self.box.periodic[-1] else "constant"
            beside = np.pad(there, ((0, 0), (reach, reach)), mode=mode)
            before = np.pad(np.cumsum(beside, axis=1), ((0, 0), (1, 0)))
            runs = before[:, 2 * reach + 1 :] - before[:, : -2 * reach - 1]
        runs = np.concatenate([runs, np.zeros((1, n), runs.dtype)])  # outside the box
        row, column = np.divmod(np.flatnonzero(here), n)
        around = stencil(self.shape[:-1], self.box.periodic[:-1], reach)
        return int(max(runs[beside, column].max(initial=0) for beside in around[row].T))

    def depth(self, count: Int[np.ndarray, " cells"]) -> int:
        """The most points that lie, in the order of cells, between one and the first or the last in
        the cells around all that follow or go before it; points are given by their counts."""
        layer = math.prod(self.shape[1:])
        row = layer // self.shape[1]
        # of its own layer all where rows are met round the end, else a few rows
        own = layer if self.box.periodic[1] else min(layer, (self.reach + 1) * row)
        stretch = min(self.reach * layer + own, self.cells)
        if self.box.periodic[0]:
            count = np.concatenate([count, count[: stretch - 1]])
        before = np.concatenate([[0], np.cumsum(count)])
        return int(np.max(before[stretch:] - before[:-stretch]))

    def sort(self, cell: Int[Array, " points"]):
        """Points in the order of their cells: their numbers, their cells, and where each begins.

        Of equal cells the smaller number comes first. A point may be in the cell past the last.
        """
        count = cell.shape[0]
        numbers = jnp.arange(count, dtype=jnp.int32)
        if (self.cells + 1) * count < 2**31:  # one sort of whole numbers, four times as fast
            key = lax.sort(cell * count + numbers)
            cell = key // count
            order = key - cell * count
        else:
            cell, order = lax.sort((cell, numbers), num_keys=1)
        edges = jnp.searchsorted(
            cell, jnp.arange(self.cells + 2, dtype=cell.dtype), method="scan"
        ).astype(jnp.int32)
        return order, cell, edges

    def bin(
        self,
        position: Float[Array, "points dim"],
        capacity: int,
        taking_part: Bool[Array, " points"] | None = None,
    ) -> CellBins:
        """Sort points into cells that hold at most `capacity` each; says so when one overflows.
        Those that take no part are in none."""
        cell = self.locate(position)
        if taking_part is not None:
            cell = jnp.where(taking_part, cell, self.cells)
        order, cell, edges = self.sort(cell)
        start, end = edges[:-1], edges[1:]
        if taking_part is not None:
            end = end.at[-1].set(start[-1])
        places = start[:, None] + jnp.arange(capacity, dtype=jnp.int32)[None, :]
        return CellBins(
            order=order,
            members=jnp.where(places < end[:, None], places, position.shape[0]).astype(jnp.int32),
            cell=cell,
            slot=jnp.arange(position.shape[0], dtype=jnp.int32) - start[cell],
            overflow=jnp.max(end - start) > capacity,
        )


def stencil(shape: tuple[int, ...], periodic: tuple[bool, ...], reach: int) -> np.ndarray:
    """(cells, neighbours): the cells around each cell of a grid, itself included, each once.

    Their number stands for "outside the box".
    """
    cells = math.prod(shape)
    index = np.indices(shape).reshape(len(shape), -1)
    offsets = []
    for n, wraps in zip(shape, periodic, strict=True):
        around = np.arange(-reach, reach + 1)
        # in a narrow periodic box the stencil would meet itself: each cell counts once
        offsets.append(np.arange(n) if wraps and len(around) > n else around)
    around = np.stack(np.meshgrid(*offsets, indexing="ij"), -1).reshape(-1, len(shape))
    outside = np.zeros((cells, len(around)), bool)
    flat = np.zeros((cells, len(around)), np.int64)
    for k, (n, wraps) in enumerate(zip(shape, periodic, strict=True)):
        place = index[k][:, None] + around[None, :, k]
        if not wraps:
            outside |= (place < 0) | (place >= n)
        flat = flat * n + place % n
    return np.where(outside, cells, flat).astype(np.int32)
