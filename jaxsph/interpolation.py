"""Interpolation of particle fields to other points by the kernel."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from .chunks import chunked_map
from .neighbors import CellBins, CellGrid
from .pairs import Space

_BLOCK = 2_000_000  # point-particle pairs weighed at a time


class ShepardMap(eqx.Module):
    """Shepard interpolation from moving particles to fixed points (paper, eq. reference operator):

        f(x_G) = sum_j f_j W(|x_G - x_j|, h) / sum_j W(|x_G - x_j|, h).

    Points and particles meet in blocks of neighbouring cells, as dense matrix products.

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
    def allocate(cls, points: Array, space: Space, margin: float = 1.6) -> ShepardMap:
        """A map to `points`, with room for `margin` times the mean number of particles per cell."""
        grid = CellGrid.with_width(space.box, space.support)
        mean = space.box.volume / space.spacing**space.box.dim / grid.cells
        points_per_cell = grid.occupancy(points)
        bins = grid.bin(points, points_per_cell)
        return cls(points, bins, grid, space, points_per_cell, int(margin * mean) + 8)

    def __call__(
        self, position: Float[Array, "particles dim"], values: Float[Array, "particles fields"]
    ) -> tuple[Float[Array, "points fields"], Bool[Array, ""]]:
        """Fields at the points, and whether a cell held more particles than there is room for."""
        space = self.space
        source = self.grid.bin(position, self.particles_per_cell)
        columns = jnp.concatenate([position, jnp.ones_like(values[:, :1]), values], axis=1)
        columns = jnp.pad(columns[source.order], ((0, 1), (0, 0)))  # a last row that weighs nothing
        points = jnp.pad(self.points[self.bins.order], ((0, 1), (0, 0)))
        around = source.members[self.grid.stencil].reshape(self.grid.cells, -1)
        dim = space.box.dim

        def weigh(block):
            targets, sources = block
            here, there = points[targets], columns[sources]
            squared = jnp.zeros((), position.dtype)
            for k in range(dim):
                separation = there[:, None, :, k] - here[:, :, None, k]
                squared = squared + space.box.minimum_image(separation, k) ** 2
            weight = space.kernel.value(jnp.sqrt(squared), space.smoothing_length, dim)
            return weight @ there[:, :, dim:]

        chunk = max(1, _BLOCK // (self.points_per_cell * around.shape[1]))
        sums = chunked_map(weigh, (self.bins.members[:-1], around), chunk)
        sums = sums[self.bins.cell, self.bins.slot][self.bins.inverse]
        return sums[:, 1:] / sums[:, :1], source.overflow
