"""Numerical diffusion of density with a renormalised gradient (delta-SPH)."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..pairs import PairTerm
from ..symmetric import inverse, outer, times
from .base import Effect


def renormalisation(pair, i, j):
    """Upper triangle of (x_j - x_i) (x) grad_i W_ij V_j"""
    return outer(pair.separation, pair.gradient)


RENORMALISATION = PairTerm("renormalisation", (), renormalisation)


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

    def geometry_terms(self, context):
        return (
            RENORMALISATION,
            PairTerm("raw_density_gradient", ("density",), raw_density_gradient),
        )

    def fields(self, context, fields, sums):
        correction = inverse(sums["renormalisation"], singular=0.0)
        return {"density_gradient": times(correction, sums["raw_density_gradient"])}

    def rate_terms(self, context):
        reads = ("density", "density_gradient")
        return (PairTerm("diffusion_sum", reads, diffusion_sum),)

    def rates(self, context, fields, sums):
        strength = 2.0 * self.delta * context.space.smoothing_length * context.fluid.sound_speed
        return {"density": strength * sums["diffusion_sum"]}
