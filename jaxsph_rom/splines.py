"""Local polyharmonic splines: modes known at fixed points, wanted at moving particles."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import scipy.linalg
from jaxtyping import Array, Float

from jaxsph import CellGrid, Space
from jaxsph.chunks import chunked_map

from .mode_interpolation import ModeInterpolation

_BLOCK = 500_000  # particle-node pairs evaluated at a time


def polyharmonic(squared: Array, order: int) -> Array:
    """gamma(r) = r^k for odd k, r^k ln r for even k, from r^2; with a derivative at r = 0."""
    positive = squared > 0.0
    safe = jnp.where(positive, squared, 1.0)
    power = safe ** (order // 2)
    value = power * jnp.sqrt(safe) if order % 2 else 0.5 * power * jnp.log(safe)
    return jnp.where(positive, value, 0.0)


class LocalSplines(ModeInterpolation):
    """Functions interpolated by one polyharmonic spline per cell (paper, eqs. PSI, section 3.2):

        phi(x) = sum_j xi_j gamma(|x - x_j|) + eta . (1, x),

    where x_j are the reference points in the cell and its neighbours and (xi, eta) solve
    [Gamma Q; Q^T 0] (xi; eta) = (phi; 0). Within a cell the interpolant is smooth and exact at the
    points; across a cell's border it jumps by as much as two neighbouring splines differ.

    Distances are in cell widths from the cell's centre, for the condition of the systems.
    """

    nodes: Float[Array, "cells nodes dim"]
    node_weights: Float[Array, "cells nodes functions"]
    linear_weights: Float[Array, "cells terms functions"]
    grid: CellGrid = eqx.field(static=True)
    order: int = eqx.field(static=True)
    capacity: int = eqx.field(static=True)

    @classmethod
    def check(cls, points, space, order):
        """A ValueError for an order below 1."""
        if order < 1:
            raise ValueError(f"order: a polyharmonic spline needs k >= 1, got {order}.")

    @classmethod
    def fit(
        cls,
        points: Float[np.ndarray, "points dim"],
        values: Float[np.ndarray, "points functions"],
        space: Space,
        order: int = 3,
        margin: float = 1.3,
    ) -> LocalSplines:
        """Factor each cell's system once and solve it for all functions (host, LAPACK).

        Args as of `ModeInterpolation.fit`: cells are at least as wide as the kernel's support, 2h
        for Wendland's, and the order is k of the polyharmonic function, 1, 2, 3, ...; `margin` is
        the room for particles per cell, over the number in a full one.

        Raises:
            ValueError: for an order below 1, or a cell neighbourhood with too few points.
        """
        cls.check(points, space, order)
        box = space.box
        grid = CellGrid.with_width(box, space.support)
        points, values = np.asarray(points), np.asarray(values)
        cell = np.asarray(grid.locate(jnp.asarray(points)))
        by_cell = [np.flatnonzero(cell == c) for c in range(grid.cells)] + [np.empty(0, int)]
        members = [np.concatenate([by_cell[c] for c in row]) for row in grid.stencil]
        largest = max(map(len, members))
        # a cell without points is inside a wall and never asked
        fewest = min(len(m) for m, own in zip(members, by_cell, strict=False) if len(own))
        if fewest < box.dim + 1:
            raise ValueError(
                f"points: a cell neighbourhood holds {fewest} reference points, too few for a "
                "spline; use a finer reference space or wider cells."
            )
        width, dim = np.asarray(grid.widths), box.dim
        nodes = np.zeros((grid.cells, largest, dim), points.dtype)
        node_weights = np.zeros((grid.cells, largest, values.shape[1]), values.dtype)
        linear_weights = np.zeros((grid.cells, dim + 1, values.shape[1]), values.dtype)
        for c, index in enumerate(members):
            if len(index) <= dim:
                continue
            offset = points[index] - grid.centers[c]
            for k in range(dim):
                if box.periodic[k]:
                    offset[:, k] -= box.lengths[k] * np.round(offset[:, k] / box.lengths[k])
            local = offset / width
            squared = ((local[:, None, :] - local[None, :, :]) ** 2).sum(axis=-1)
            system = np.zeros((len(index) + dim + 1,) * 2)
            system[: len(index), : len(index)] = _polyharmonic_host(squared, order)
            system[: len(index), len(index)] = system[len(index), : len(index)] = 1.0
            system[: len(index), len(index) + 1 :] = local
            system[len(index) + 1 :, : len(index)] = local.T
            right = np.zeros((len(system), values.shape[1]))
            right[: len(index)] = values[index]
            factors = scipy.linalg.lu_factor(system, overwrite_a=True, check_finite=False)
            solution = scipy.linalg.lu_solve(factors, right, check_finite=False)
            nodes[c, : len(index)] = local
            node_weights[c, : len(index)] = solution[: len(index)]
            linear_weights[c] = solution[len(index) :]
        full = np.prod(width) / space.spacing**dim
        capacity = int(margin * full) + 6
        return cls(
            jnp.asarray(nodes),
            jnp.asarray(node_weights),
            jnp.asarray(linear_weights),
            grid,
            order,
            capacity,
        )

    @property
    def box(self):
        return self.grid.box

    @property
    def functions(self):
        return self.linear_weights.shape[2]

    def combined(self, matrix):
        return self._of(self.node_weights @ matrix, self.linear_weights @ matrix)

    def select(self, functions):
        return self._of(self.node_weights[:, :, functions], self.linear_weights[:, :, functions])

    def _of(self, node_weights, linear_weights) -> LocalSplines:
        weights = node_weights, linear_weights
        return eqx.tree_at(lambda s: (s.node_weights, s.linear_weights), self, weights)

    def overflow(self, position):
        return self.grid.bin(position, self.capacity).overflow

    def __call__(self, position):
        box, dim = self.grid.box, self.grid.box.dim
        bins = self.grid.bin(position, self.capacity)
        padded = jnp.pad(position[bins.order], ((0, 1), (0, 0)))
        widths = self.grid.widths
        centers = jnp.asarray(self.grid.centers, position.dtype)

        def evaluate(block):
            members, center, nodes, node_weights, linear_weights = block
            local = [
                box.minimum_image(padded[members][:, :, k] - center[:, k : k + 1], k) / widths[k]
                for k in range(dim)
            ]
            squared = sum((local[k][:, :, None] - nodes[:, None, :, k]) ** 2 for k in range(dim))
            linear = jnp.stack([jnp.ones_like(local[0]), *local], axis=-1)
            radial = polyharmonic(squared, self.order)
            return radial @ node_weights + linear @ linear_weights

        blocks = (
            bins.members[:-1], centers, self.nodes, self.node_weights, self.linear_weights
        )  # fmt: skip
        chunk = max(1, _BLOCK // (self.capacity * self.nodes.shape[1]))
        values = chunked_map(evaluate, blocks, chunk)
        return values[bins.cell, bins.slot][bins.inverse]


def _polyharmonic_host(squared: np.ndarray, order: int) -> np.ndarray:
    safe = np.where(squared > 0.0, squared, 1.0)
    value = safe ** (order / 2.0) * (1.0 if order % 2 else 0.5 * np.log(safe))
    return np.where(squared > 0.0, value, 0.0)
