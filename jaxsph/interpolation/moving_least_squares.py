"""Interpolation by moving least squares."""

import jax.numpy as jnp

from .kernel_map import KernelMap


class MovingLeastSquaresMap(KernelMap):
    """First-order moving least squares (Lancaster and Salkauskas 1981; in SPH, Dilts 1999):

        f(x_G) = a . (1, x_G),    a = argmin sum_j [f_j - a . (1, x_j)]^2 W(|x_G - x_j|, h).

    Linear fields are kept, next to walls too. Where too few particles leave `a` undetermined the
    point gets Shepard's value.
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

    def columns(self, local, values):
        dim = local.shape[-1]
        basis = _with_one(local)
        moments = [basis[..., a] * basis[..., b] for a, b in _upper(dim + 1)]
        products = basis[..., :, None] * values[..., None, :]
        return jnp.concatenate(
            [jnp.stack(moments, axis=-1), products.reshape(*values.shape[:-1], -1)], axis=-1
        )

    def fields(self, local, sums):
        size = local.shape[-1] + 1
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
        # the spread of the particles about the point's own place, as a share of the support's
        determined = jnp.linalg.det(matrix / jnp.where(weight > 0.0, weight, 1.0)) > 1e-6
        safe = jnp.where(determined[..., None, None], matrix, jnp.eye(size, dtype=matrix.dtype))
        fitted = jnp.einsum("...a,...af->...f", _with_one(local), jnp.linalg.solve(safe, right))
        return jnp.where(determined[..., None], fitted, right[..., 0, :] / weight[..., 0])


def _with_one(local):
    return jnp.concatenate([jnp.ones_like(local[..., :1]), local], axis=-1)


def _upper(size):
    return [(a, b) for a in range(size) for b in range(a, size)]
