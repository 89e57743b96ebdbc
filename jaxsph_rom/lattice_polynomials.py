"""Piecewise polynomials on a lattice: modes known at its points, wanted at moving particles."""

from __future__ import annotations

from itertools import product
from math import prod

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsph import Box, Space

from .mode_interpolation import ModeInterpolation

_ASKEW = 1e-6  # of the spacing: farther from its place a point is not on the lattice


class LatticePolynomials(ModeInterpolation):
    """Functions interpolated by tensor products of Lagrange polynomials, for a lattice of points:

        phi(x) = sum_j phi_j prod_k l_jk((x_k - x_jk) / dx_k),

    over the (p + 1)^n points around x, p odd; at walls the stencil is one-sided. Continuous, and
    exact for polynomials of degree p. A particle reads (p + 1)^n points where a local spline reads
    those of 3^n cells, and no particle is ever one too many.
    """

    values: Float[Array, "points functions"]
    lattice: Box = eqx.field(static=True)
    shape: tuple[int, ...] = eqx.field(static=True)
    order: int = eqx.field(static=True)

    @classmethod
    def check(cls, points, space, order):
        """A ValueError if the points are not a lattice that fills the box, or not enough of them.

        The order must be odd.
        """
        if order < 1 or order % 2 == 0:
            raise ValueError(f"order: polynomials need an odd one, 1, 3, ...; got {order}.")
        if not on_lattice(points, space, order):
            raise ValueError(
                "points: polynomials need a lattice that fills the box and has more than "
                f"{order} points in each direction; use splines."
            )

    @classmethod
    def fit(cls, points, values, space, order=3):
        cls.check(points, space, order)
        shape = _shape(space)
        ordered = np.empty_like(np.asarray(values))
        ordered[_numbers(points, space.box, shape)] = values
        return cls(jnp.asarray(ordered), space.box, shape, order)

    @property
    def box(self):
        return self.lattice

    @property
    def functions(self):
        return self.values.shape[1]

    def combined(self, matrix):
        return eqx.tree_at(lambda s: s.values, self, self.values @ matrix)

    def select(self, functions):
        return eqx.tree_at(lambda s: s.values, self, self.values[:, functions])

    def overflow(self, position):
        return jnp.zeros((), bool)

    def __call__(self, position):
        along = self._along(position)
        return self._sum(position, [[(numbers, weights) for numbers, weights, _ in along]])

    def slope_along(self, position, direction):
        """direction . grad phi at particles, in one sum over the stencil."""
        along = self._along(position)
        moved = [[(numbers, weights) for numbers, weights, _ in along] for _ in along]
        for k, (numbers, _, slopes) in enumerate(along):
            moved[k][k] = numbers, [direction[:, k] * slope for slope in slopes]
        return self._sum(position, moved)

    def _sum(self, position, products) -> Float[Array, "particles functions"]:
        """Over the stencil, of values weighted by a sum of products of weights along each axis."""
        found = jnp.zeros((position.shape[0], self.functions), self.values.dtype)
        for stencil in product(range(self.order + 1), repeat=self.box.dim):
            row = jnp.zeros(position.shape[0], jnp.int32)
            for k, place in enumerate(stencil):
                row = row * self.shape[k] + products[0][k][0][place]
            weight = sum(
                prod(weights[place] for (_, weights), place in zip(axes, stencil, strict=True))
                for axes in products
            )
            there = self.values.at[row].get(mode="promise_in_bounds", wrap_negative_indices=False)
            found = found + weight[:, None] * there
        return found

    def _along(self, position) -> list[tuple[list[Array], list[Array], list[Array]]]:
        """Along each axis, of the p + 1 points about each particle, their numbers, their weights
        there and the weights' slopes [1/m]."""
        return list(map(self._along_axis, range(self.box.dim), position.T))

    def _along_axis(self, k: int, x: Float[Array, " particles"]):
        count, last = self.shape[k], self.order
        per_length = count / self.box.lengths[k]
        place = (x - self.box.lower[k]) * per_length - 0.5
        first = jnp.floor(place).astype(jnp.int32) - last // 2
        if not self.box.periodic[k]:
            first = jnp.clip(first, 0, count - 1 - last)
        local = place - first.astype(x.dtype)
        numbers, weights, slopes = [], [], []
        for j in range(last + 1):
            number = first + j
            numbers.append(number % count if self.box.periodic[k] else number)
            others = [i for i in range(last + 1) if i != j]
            factors = [(local - i) / (j - i) for i in others]
            weights.append(prod(factors))
            slopes.append(
                sum(per_length / (j - i) * prod(factors[:n] + factors[n + 1 :], start=1.0)
                    for n, i in enumerate(others))
            )  # fmt: skip
        return numbers, weights, slopes


def on_lattice(points: Float[np.ndarray, "points dim"], space: Space, order: int = 3) -> bool:
    """Whether points are a lattice that fills the box, so large as the order needs."""
    shape = _shape(space)
    return min(shape) > order and _numbers(points, space.box, shape) is not None


def _shape(space: Space) -> tuple[int, ...]:
    return tuple(round(length / space.spacing) for length in space.box.lengths)


def _numbers(points, box: Box, shape: tuple[int, ...]) -> np.ndarray | None:
    """The number of each point in the lattice, or None if they are not all of its points."""
    points = np.asarray(points)
    if len(points) != np.prod(shape):
        return None
    place = (points - np.asarray(box.lower)) / np.asarray(box.lengths) * shape - 0.5
    index = np.rint(place).astype(int)
    if np.abs(place - index).max() > _ASKEW or (index < 0).any() or (index >= shape).any():
        return None
    number = np.ravel_multi_index(tuple(index.T), shape)
    return number if len(np.unique(number)) == len(number) else None
