"""Interpolation by moving least squares."""

import abc

import jax.numpy as jnp
from jaxtyping import Array, Float

from .kernel_map import KernelMap

_LEAST = 0.13  # of the kernel's support: particles closer together leave a quadratic undetermined


class LeastSquaresMap(KernelMap):
    """Moving least squares by polynomials (Lancaster and Salkauskas 1981; in SPH, Dilts 1999):

        f(x_G) = a . q(x_G),    a = argmin sum_j [f_j - a . q(x_j)]^2 W(|x_G - x_j|, h).

    Where too few particles leave `a` undetermined the point gets Shepard's value.
    """

    @classmethod
    def allocate(cls, points, space, margin=1.6):
        for length, periodic in zip(space.box.lengths, space.box.periodic, strict=True):
            if periodic and length < 3.0 * space.support:  # places about a cell would be ambiguous
                raise ValueError(
                    f"box: moving least squares need a periodic length of at least three kernel "
                    f"supports, {3.0 * space.support:g} m, got {length:g} m; raise the resolution "
                    "or lower h/dx."
                )
        return super().allocate(points, space, margin)

    @abc.abstractmethod
    def polynomials(self, local: Float[Array, "*places dim"]) -> Float[Array, "*places terms"]:
        """q, its first term 1, at places in supports from their block's centre."""

    @abc.abstractmethod
    def least_spread(self, dim: int) -> float:
        """The determinant of the moments, over their weight, below which `a` is undetermined."""

    def columns(self, local, values):
        basis = self.polynomials(local)
        moments = [basis[..., a] * basis[..., b] for a, b in _upper(basis.shape[-1])]
        products = basis[..., :, None] * values[..., None, :]
        return jnp.concatenate(
            [jnp.stack(moments, axis=-1), products.reshape(*values.shape[:-1], -1)], axis=-1
        )

    def fields(self, local, sums):
        basis = self.polynomials(local)
        size = basis.shape[-1]
        pairs = _upper(size)
        number = {pair: k for k, pair in enumerate(pairs)}
        matrix = jnp.stack(
            [
                jnp.stack([sums[..., number[min(a, b), max(a, b)]] for b in range(size)], axis=-1)
                for a in range(size)
            ],
            axis=-2,
        )
        right = sums[..., len(pairs) :].reshape(*sums.shape[:-1], size, -1)
        weight = matrix[..., :1, :1]
        # the same wherever the block's centre is: the spread of the particles alone
        spread = jnp.linalg.det(matrix / jnp.where(weight > 0.0, weight, 1.0))
        determined = spread > self.least_spread(local.shape[-1])
        safe = jnp.where(determined[..., None, None], matrix, jnp.eye(size, dtype=matrix.dtype))
        fitted = jnp.einsum("...a,...af->...f", basis, jnp.linalg.solve(safe, right))
        return jnp.where(determined[..., None], fitted, right[..., 0, :] / weight[..., 0])


class MovingLeastSquaresMap(LeastSquaresMap):
    """First order, q = (1, x): linear fields are kept, next to walls too."""

    def least_spread(self, dim):
        return 1e-6

    def polynomials(self, local):
        return _with_one(local)


class QuadraticMap(LeastSquaresMap):
    """Second order, q = (1, x, products of two): quadratic fields are kept, next to walls too, and
    what evenly spread particles lose of a wave is of fourth order.
    """

    def least_spread(self, dim):
        return _LEAST ** (2 * dim * (dim + 2))  # the determinant's power of a length

    def polynomials(self, local):
        dim = local.shape[-1]
        products = [local[..., a] * local[..., b] for a in range(dim) for b in range(a, dim)]
        return jnp.concatenate([_with_one(local), jnp.stack(products, axis=-1)], axis=-1)


def _with_one(local):
    return jnp.concatenate([jnp.ones_like(local[..., :1]), local], axis=-1)


def _upper(size):
    return [(a, b) for a in range(size) for b in range(a, size)]
