"""Shepard interpolation."""

import jax.numpy as jnp

from .kernel_map import KernelMap


class ShepardMap(KernelMap):
    """Shepard interpolation from moving particles to fixed points (paper, eq. reference operator):

        f(x_G) = sum_j f_j W(|x_G - x_j|, h) / sum_j W(|x_G - x_j|, h).

    It keeps constants; a wave is smoothed at second order, and next to a wall at first.
    """

    def columns(self, local, values):
        return jnp.concatenate([jnp.ones_like(local[..., :1]), values], axis=-1)

    def fields(self, local, sums):
        return sums[..., 1:] / sums[..., :1]
