"""Maps from moving particles to fixed points that weigh particles by the kernel."""

from __future__ import annotations

import abc
from typing import Self

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..chunks import chunked_map
from ..compiled import full_precision
from ..neighbors import CellBins, CellGrid
from ..pairs import Space

_BLOCK = 2_000_000  # point-particle pairs weighed at a time


class KernelMap(eqx.Module):
    """From sums over the particles within the kernel's support of a point to fields there.

    Points and particles meet in blocks of neighbouring cells, as dense matrix products. A rule says
    which columns of each particle are summed, and what the finished sums mean.

    Args:
        points: x_G (G, n) [m].
        space: box, kernel and smoothing length.
        particles_per_cell: capacity; see `allocate`.
    """

    points: Float[Array, "points dim"]
    bins: CellBins
    grid: CellGrid = eqx.field(static=True)
    space: Space = eqx.field(static=True)
    points_per_cell: int = eqx.field(static=True)
    particles_per_cell: int = eqx.field(static=True)

    @classmethod
    def allocate(cls, points: Array, space: Space, margin: float = 1.6) -> Self:
        """A map to `points`, with room for `margin` times the mean number of particles per cell.

        Raises:
            ValueError: if the box does not suit the rule.
        """
        grid = CellGrid.with_width(space.box, space.support)
        mean = space.box.volume / space.spacing**space.box.dim / grid.cells
        points_per_cell = int(grid.counts(points).max())
        bins = grid.bin(points, points_per_cell)
        return cls(points, bins, grid, space, points_per_cell, int(margin * mean) + 8)

    @abc.abstractmethod
    def columns(
        self, local: Float[Array, "*particles dim"], values: Float[Array, "*particles fields"]
    ) -> Float[Array, "*particles columns"]:
        """What is summed of particles at `local` places, in supports from their block's centre."""

    @abc.abstractmethod
    def fields(
        self, local: Float[Array, "points dim"], sums: Float[Array, "points columns"]
    ) -> Float[Array, "points fields"]:
        """Fields at points from their sums, for a row of padding anything."""

    @full_precision
    def __call__(
        self,
        position: Float[Array, "particles dim"],
        values: Float[Array, "particles fields"],
        active: Bool[Array, " particles"] | None = None,
    ) -> tuple[Float[Array, "points fields"], Bool[Array, ""]]:
        """Fields at the points, and whether a cell held more particles than there is room for;
        those that are not active are left out."""
        space, dim = self.space, self.space.box.dim
        source = self.grid.bin(position, self.particles_per_cell, active)
        table = jnp.concatenate([position, values], axis=1)[source.order]
        table = jnp.pad(table, ((0, 1), (0, 0)))  # a last row, which is given no weight
        points = jnp.pad(self.points[self.bins.order], ((0, 1), (0, 0)))
        around = source.members[self.grid.stencil].reshape(self.grid.cells, -1)
        centers = jnp.asarray(self.grid.centers, position.dtype)

        def from_center(x, center):
            parts = [space.box.minimum_image(x[..., k] - center[:, None, k], k) for k in range(dim)]
            return jnp.stack(parts, axis=-1) / space.support

        def evaluate(block):
            targets, sources, center = block
            here, there = points[targets], table[sources]
            squared = jnp.zeros((), position.dtype)
            for k in range(dim):
                separation = there[:, None, :, k] - here[:, :, None, k]
                squared = squared + space.box.minimum_image(separation, k) ** 2
            apart = squared > 0.0  # the root has no slope at zero; kernels have none there either
            distance = jnp.where(apart, jnp.sqrt(jnp.where(apart, squared, 1.0)), 0.0)
            weight = space.kernel.value(distance, space.smoothing_length, dim)
            weight = jnp.where((sources < position.shape[0])[:, None, :], weight, 0.0)
            columns = self.columns(from_center(there[..., :dim], center), there[..., dim:])
            # rows of padding are cut off, or what their fields divide by spoils reverse mode
            real = (targets < self.points.shape[0])[..., None]
            sums = jnp.where(real, weight @ columns, 1.0)
            return self.fields(from_center(here, center), sums)

        chunk = max(1, _BLOCK // (self.points_per_cell * around.shape[1]))
        found = chunked_map(evaluate, (self.bins.members[:-1], around, centers), chunk)
        return found[self.bins.cell, self.bins.slot][self.bins.inverse], source.overflow
