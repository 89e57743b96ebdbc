"""Where the free surface is."""

import jax.numpy as jnp

from ..at_ghosts import Same
from ..pairs import PairTerm
from ..ramps import ramp, root
from ..symmetric import smallest_eigenvalue
from ..vector import Vector
from .base import Effect
from .kernel_gradient import KERNEL_GRADIENT

_SPLASH = (0.25, 0.4)  # of completeness: single particles and thin jets lie below
_INTERIOR = (0.95, 0.995)  # 0.50, 0.70, 0.94, 0.999 in the rows under a flat surface, h = 2 dx


def support_matrix(pair, i, j):
    """Upper triangle of (x_j - x_i) (x) grad_i W_ij V_j"""
    d, g = pair.separation, pair.gradient
    return Vector(d[a] * g[b] for a in range(len(d)) for b in range(a, len(d)))


class FreeSurface(Effect):
    """Tells particles near a free surface from those inside (Marrone et al. 2010):

        lambda_i = smallest eigenvalue of sum_j (x_j - x_i) (x) grad_i W_ij V_j,
        n_i = -sum_j grad_i W_ij V_j / |sum_j grad_i W_ij V_j|.

    lambda is 1 where the kernel's support is full and 1/2 on a flat surface. Ghosts count as
    neighbours: a wall is no free surface. Gives fields, and no rates, to the effects behind it:

    - `surface_normal` n (N, n), outward;
    - `interior` (N,), 0 where the support is cut by the surface, 1 where it is full;
    - `coherent` (N,), 0 for a particle that flies alone or in a thin jet, 1 in the body of fluid.

    The paper has no free surface; thresholds are ramps, so that all stays differentiable.

    Raises:
        ValueError: if `TensileControl` stands before it.
    """

    @property
    def frees_surface(self):
        return True

    def on_fixed_points(self):
        raise ValueError(
            "effects: a free surface moves across points that stay, and FreeSurface has no form "
            "there; choose a scene whose fluid fills its box or vessel, or, for waves whose "
            "particles do not mix, jaxsph_rom.labels.train."
        )

    def geometry_terms(self, context):
        return (PairTerm("support_matrix", (), support_matrix, Same()), KERNEL_GRADIENT)

    def fields(self, context, fields, sums):
        if "tensile_release" in fields:  # it would have taken the surface for the inside
            raise ValueError(
                "effects: FreeSurface must stand before TensileControl; move it there."
            )
        completeness = smallest_eigenvalue(sums["support_matrix"])
        return {
            "surface_normal": -_direction(sums["kernel_gradient"], context.space),
            "interior": ramp(completeness, *_INTERIOR),
            "coherent": ramp(completeness, *_SPLASH),
        }


def _direction(vectors, space):
    """Unit vectors along `vectors` [1/m], zero where these are lost in round-off."""
    scaled = vectors * space.smoothing_length
    length = root(jnp.sum(scaled * scaled, axis=1))
    return scaled / jnp.where(length > 0.0, length, 1.0)[:, None]
