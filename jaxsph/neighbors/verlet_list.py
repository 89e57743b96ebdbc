"""The neighbour list with a Verlet skin, of fixed capacity, built from a cell grid inside jit."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float, Int

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


@dataclass(frozen=True)
class NeighborSearch:
    """Capacities and radii of a neighbour list; chosen outside jit, static inside it.

    Args:
        grid: cells at least half a search radius wide, with reach 2.
        support: radius of the kernel's support [m].
        skin: extra radius [m]; the list stays valid until a particle has moved half of it.
        capacity: neighbours a particle can have.
        cell_capacity: particles a cell can hold.
    """

    grid: CellGrid
    support: float
    skin: float
    capacity: int
    cell_capacity: int

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
        for length, periodic in zip(box.lengths, box.periodic, strict=True):
            if periodic and length < 2.0 * radius:
                raise ValueError(
                    f"box: a periodic length of {length:g} m is too small for a kernel support of "
                    f"{support:g} m (with skin {radius:g} m); it needs at least {2 * radius:g} m. "
                    "Raise the resolution or lower h/dx."
                )
        grid = CellGrid.with_width(box, 0.5 * radius, reach=2)
        cell_capacity = int(1.3 * grid.occupancy(position)) + 2
        trial = cls(grid, support, skin, 1, cell_capacity)
        largest = int(jax.jit(lambda x: trial._flag(x)[2])(position))
        capacity = max(8, int(np.ceil(margin * largest)))
        capacity = min(capacity, max(1, position.shape[0] - 1))
        return cls(grid, support, skin, capacity, cell_capacity)

    def enlarged(self) -> NeighborSearch:
        """The same search with a fifth more room."""
        return replace(
            self,
            capacity=math.ceil(1.2 * self.capacity),
            cell_capacity=math.ceil(1.2 * self.cell_capacity),
        )

    def build(self, position: Float[Array, "particles dim"]) -> VerletList:
        """The list of all neighbours within support + skin of each particle, inside jit."""
        position = lax.stop_gradient(position)
        bins, words, largest = self._flag(position)
        return VerletList(
            index=self._pick(bins, words),
            order=bins.order,
            inverse=bins.inverse.astype(jnp.int32),
            reference=position,
            largest_count=largest,
            cell_overflow=bins.overflow.astype(jnp.int32),
        )

    def _candidates(self, bins: CellBins) -> Int[Array, "cells candidates"]:
        """Sorted places of all particles in each cell's neighbourhood, N where there is none."""
        around = bins.members[self.grid.stencil].reshape(self.grid.cells, -1)
        padding = -around.shape[1] % _WORD
        return jnp.pad(around, ((0, 0), (0, padding)), constant_values=bins.order.shape[0])

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
            bits = near.reshape(near.shape[:2] + (-1, _WORD)).astype(jnp.uint32)
            bits = bits << jnp.arange(_WORD, dtype=jnp.uint32).reshape(1, 1, 1, _WORD)
            return jnp.sum(bits, axis=-1, dtype=jnp.uint32)

        chunk = max(1, _BLOCK // (self.cell_capacity * candidates.shape[1]))
        words = chunked_map(flag, (bins.members[:-1], candidates), chunk)
        words = words[bins.cell, bins.slot]
        counts = jnp.sum(lax.population_count(words), axis=1, dtype=jnp.uint32).astype(jnp.int32)
        return bins, words, jnp.max(counts)

    def _pick(self, bins: CellBins, words) -> Int[Array, "particles capacity"]:
        """Turn each particle's bits into a list: slot k holds the k-th set bit's candidate."""
        candidates = self._candidates(bins).reshape(-1)
        count = words.shape[1]
        slots = jnp.arange(self.capacity, dtype=jnp.int32)[None, :]
        along = partial(jnp.take_along_axis, axis=1, mode="promise_in_bounds")

        def pick(block):
            words, cell, own = block
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
            place = candidates.at[(cell[:, None] * count + word) * _WORD + bit].get(
                mode="promise_in_bounds"
            )
            return jnp.where(found, place, own[:, None])

        own = jnp.arange(words.shape[0], dtype=jnp.int32)
        chunk = max(1, _BLOCK // (self.capacity * count))
        return chunked_map(pick, (words, bins.cell, own), chunk)
