"""Numerical diffusion of density with a renormalised gradient (delta-SPH)."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..pairs import PairTerm
from ..vector import Vector
from .base import Effect


def renormalisation(pair, i, j):
    """Upper triangle of (x_j - x_i) (x) grad_i W_ij V_j"""
    d, g = pair.separation, pair.gradient
    return Vector(d[a] * g[b] for a in range(len(d)) for b in range(a, len(d)))


def raw_density_gradient(pair, i, j):
    """(rho_j - rho_i) grad_i W_ij V_j"""
    return pair.gradient * (j.density - i.density)


def diffusion_sum(pair, i, j):
    """[rho_j - rho_i - (g_j + g_i) . (x_j - x_i) / 2] (x_j - x_i) . grad_i W_ij / r^2 V_j"""
    mean_slope = (i.density_gradient + j.density_gradient).dot(pair.separation) * 0.5
    return (j.density - i.density - mean_slope) * pair.radial_slope


class DensityDiffusion(Effect):
    """drho_i/dt = delta h c0 D_i (paper, continuity, last term; Antuono et al. 2010):

        D_i = 2 sum_j [rho_j - rho_i - (<grad rho>_j + <grad rho>_i).(x_j - x_i)/2]
                      (x_j - x_i) . grad_i W_ij / r^2 V_j,
        <grad rho>_i = L_i sum_j (rho_j - rho_i) grad_i W_ij V_j,
        L_i = [sum_j (x_j - x_i) (x) grad_i W_ij V_j]^-1.

    Where too few neighbours leave L_i singular the gradient counts as zero.

    Args:
        delta: strength, conventionally 0.1.
    """

    delta: Float[Array, ""] = eqx.field(converter=jnp.asarray)

    def geometry_terms(self, space):
        return (
            PairTerm("renormalisation", (), renormalisation),
            PairTerm("raw_density_gradient", ("density",), raw_density_gradient),
        )

    def fields(self, context, fields, sums):
        gradient = _solve_symmetric(sums["renormalisation"], sums["raw_density_gradient"])
        return {"density_gradient": gradient}

    def rate_terms(self, space):
        reads = ("density", "density_gradient")
        return (PairTerm("diffusion_sum", reads, diffusion_sum),)

    def rates(self, context, fields, sums):
        strength = 2.0 * self.delta * context.space.smoothing_length * context.fluid.sound_speed
        return {"density": strength * sums["diffusion_sum"]}


def _solve_symmetric(upper, right):
    """Rows of A^-1 b for symmetric A of size 2 or 3 given by its upper triangle; 0 if singular."""
    if right.shape[1] == 2:
        a, b, d = (upper[:, k] for k in range(3))
        adjugate = ((d, -b), (-b, a))
        determinant = a * d - b * b
    else:
        a, b, c, d, e, f = (upper[:, k] for k in range(6))
        adjugate = (
            (d * f - e * e, c * e - b * f, b * e - c * d),
            (c * e - b * f, a * f - c * c, b * c - a * e),
            (b * e - c * d, b * c - a * e, a * d - b * b),
        )
        determinant = a * adjugate[0][0] + b * adjugate[0][1] + c * adjugate[0][2]
    regular = jnp.abs(determinant) > 1e-3  # 1 for a full neighbourhood
    scale = jnp.where(regular, 1.0 / jnp.where(regular, determinant, 1.0), 0.0)
    columns = [scale * sum(entry * right[:, k] for k, entry in enumerate(row)) for row in adjugate]
    return jnp.stack(columns, axis=-1)
