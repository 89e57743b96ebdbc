"""The neighbour list with a Verlet skin, of fixed capacity, built from a cell grid inside jit."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Float, Int, UInt32

from ..chunks import chunked_map
from ..domain import Box
from .cell_grid import CellBins, CellGrid

CAPACITY_MARGIN = 1.15  # room in the list over its need at the start; every slot costs time
_WORD = 32  # candidates are flagged in the bits of 32-bit words
_BLOCK = 16_000_000  # particle-candidate pairs examined at a time


class VerletList(eqx.Module):
    """Neighbours of every particle, in cell-sorted order.

    Row k of `index` lists the sorted places of the neighbours of the particle at sorted place k;
    free slots point to k itself, whose separation is zero and so adds nothing to a pair sum.
    """

    index: Int[Array, "particles capacity"]
    order: Int[Array, " particles"]
    inverse: Int[Array, " particles"]
    reference: Float[Array, "particles dim"]
    largest_count: Int[Array, ""]
    cell_overflow: Int[Array, ""]

    def sort(self, field: Array) -> Array:
        """A per-particle field in the list's cell-sorted order."""
        return field.at[self.order].get(mode="promise_in_bounds", unique_indices=True)

    def unsort(self, field: Array) -> Array:
        """A field in cell-sorted order back in the particles' own order."""
        return field.at[self.inverse].get(mode="promise_in_bounds", unique_indices=True)

    def largest_motion(self, box: Box, position: Array) -> tuple[Array, Array]:
        """The longest way [m] that a particle has gone since the list was built, and which one."""
        moved = box.displacement(self.reference, lax.stop_gradient(position))
        squared = jnp.sum(moved * moved, axis=1)
        particle = jnp.argmax(squared)
        return jnp.sqrt(squared[particle]), particle

    @property
    def overflow(self) -> Array:
        """Whether a row or a cell had more entries than fit; the list is then not usable."""
        return (self.largest_count > self.index.shape[1]) | (self.cell_overflow > 0)


class NeighborSearch(eqx.Module):
    """Capacities and radii of a neighbour list; chosen outside jit, static inside it.

    Args:
        grid: cells at least half a search radius wide, with reach 2.
        support: radius of the kernel's support [m].
        skin: extra radius [m]; the list stays valid until a particle has moved half of it.
        capacity: neighbours a particle can have.
        cell_capacity: particles a cell can hold.
    """

    grid: CellGrid = eqx.field(static=True)
    support: float = eqx.field(static=True)
    skin: float = eqx.field(static=True)
    capacity: int = eqx.field(static=True)
    cell_capacity: int = eqx.field(static=True)

    @classmethod
    def allocate(
        cls,
        position: Float[Array, "particles dim"],
        box: Box,
        support: float,
        skin: float,
        margin: float = CAPACITY_MARGIN,
    ) -> NeighborSearch:
        """Choose capacities for particles near `position`, `margin` times what these need.

        Raises:
            ValueError: if a periodic box is too small for the support and its skin, or there is
                no particle.
        """
        if position.shape[0] == 0:
            raise ValueError("position: got no particles; give at least one.")
        radius = support + skin
        check_periodic(box, support, skin)
        grid = CellGrid.with_width(box, 0.5 * radius, reach=2)
        cell_capacity = int(1.3 * grid.occupancy(position)) + 2
        trial = cls(grid, support, skin, 1, cell_capacity)
        largest = int(_most_neighbors(trial, position))
        capacity = max(8, int(np.ceil(margin * largest)))
        capacity = min(capacity, max(1, position.shape[0] - 1))
        return cls(grid, support, skin, capacity, cell_capacity)

    @property
    def box(self) -> Box:
        return self.grid.box

    def enlarged(self) -> NeighborSearch:
        """The same search with a fifth more room."""
        return replace(
            self,
            capacity=math.ceil(1.2 * self.capacity),
            cell_capacity=math.ceil(1.2 * self.cell_capacity),
        )

    def largest_motion(self, neighbors: VerletList, position: Array) -> tuple[Array, Array]:
        """The longest way [m] that a particle has gone since the list was built, and which one."""
        return neighbors.largest_motion(self.box, position)

    def build(self, position: Float[Array, "particles dim"]) -> VerletList:
        """The list of all neighbours within support + skin of each particle, inside jit."""
        position = lax.stop_gradient(position)
        bins, words, largest = self._flag(position)
        return VerletList(
            index=pick(words, bins.cell, self._candidates(bins), self.capacity),
            order=bins.order,
            inverse=bins.inverse.astype(jnp.int32),
            reference=position,
            largest_count=largest,
            cell_overflow=bins.overflow.astype(jnp.int32),
        )

    def _candidates(self, bins: CellBins) -> Int[Array, "cells candidates"]:
        """Sorted places of all particles in each cell's neighbourhood, N where there is none."""
        return candidates(bins, self.grid, bins.order.shape[0])

    def _flag(self, position):
        """Bins, and for each particle a bit per candidate of its cell: neighbour or not."""
        bins = self.grid.bin(position, self.cell_capacity)
        nowhere = jnp.full((1, position.shape[1]), jnp.nan, position.dtype)
        padded = jnp.concatenate([position[bins.order], nowhere])
        candidates = self._candidates(bins)
        radius_squared = (self.support + self.skin) ** 2

        def flag(block):
            members, around = block
            here, there = padded[members], padded[around]
            squared = jnp.zeros((), position.dtype)
            for k in range(position.shape[1]):
                separation = there[:, None, :, k] - here[:, :, None, k]
                squared = squared + self.grid.box.minimum_image(separation, k) ** 2
            near = (squared < radius_squared) & (around[:, None, :] != members[:, :, None])
            return pack(near)

        chunk = max(1, _BLOCK // (self.cell_capacity * candidates.shape[1]))
        words = chunked_map(flag, (bins.members[:-1], candidates), chunk)
        words = words[bins.cell, bins.slot]
        return bins, words, jnp.max(count_bits(words))


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


def candidates(bins: CellBins, grid: CellGrid, nothing: int) -> Int[Array, "cells candidates"]:
    """Members of all cells around each cell, filled up with `nothing` to whole words of bits."""
    around = bins.members[grid.stencil].reshape(grid.cells, -1)
    padding = -around.shape[1] % _WORD
    return jnp.pad(around, ((0, 0), (0, padding)), constant_values=nothing)


def pack(flags: Bool[Array, "*rows candidates"]) -> UInt32[Array, "*rows words"]:
    """Flags as the bits of 32-bit words."""
    bits = flags.reshape(flags.shape[:-1] + (-1, _WORD)).astype(jnp.uint32)
    shift = jnp.arange(_WORD, dtype=jnp.uint32).reshape((1,) * flags.ndim + (_WORD,))
    return jnp.sum(bits << shift, axis=-1, dtype=jnp.uint32)


def count_bits(words: UInt32[Array, "rows words"]) -> Int[Array, " rows"]:
    """Number of set bits of each row."""
    return jnp.sum(lax.population_count(words), axis=1, dtype=jnp.uint32).astype(jnp.int32)


def pick(
    words: UInt32[Array, "rows words"],
    cell: Int[Array, " rows"],
    candidates: Int[Array, "cells candidates"],
    capacity: int,
    own: int = 0,
    entry: int = 0,
) -> Int[Array, "rows capacity"]:
    """Each row's bits as a list: slot k holds the candidate of the k-th set bit.

    A free slot holds the row's own number. Row numbers count from `own`, entries from `entry`.
    """
    count = words.shape[1]
    flat = candidates.reshape(-1)
    slots = jnp.arange(capacity, dtype=jnp.int32)[None, :]
    along = partial(jnp.take_along_axis, axis=1, mode="promise_in_bounds")

    def rows(block):
        words, cell, row = block
        counts = lax.population_count(words).astype(jnp.int32)
        through = jnp.cumsum(counts, axis=1, dtype=jnp.int32)
        before = through[:, :, None] <= slots[:, None, :]
        word = jnp.sum(before, axis=1, dtype=jnp.int32)
        found = word < count
        word = jnp.minimum(word, count - 1)
        rank = slots - along(through - counts, word)
        bits = along(words, word)
        bit = jnp.zeros_like(rank)
        for half in (16, 8, 4, 2, 1):  # binary search for the rank-th set bit
            low = bits & jnp.uint32((1 << half) - 1)
            below = lax.population_count(low).astype(jnp.int32)
            upper = rank >= below
            rank = jnp.where(upper, rank - below, rank)
            bits = jnp.where(upper, bits >> jnp.uint32(half), bits)
            bit = jnp.where(upper, bit + half, bit)
        place = (cell[:, None] * count + word) * _WORD + bit
        place = flat.at[place].get(mode="promise_in_bounds")
        return jnp.where(found, place + entry, row[:, None])

    row = own + jnp.arange(words.shape[0], dtype=jnp.int32)
    return chunked_map(rows, (words, cell, row), max(1, _BLOCK // (capacity * count)))


@eqx.filter_jit  # compiled once for scenes alike
def _most_neighbors(search: NeighborSearch, position):
    return search._flag(position)[2]
