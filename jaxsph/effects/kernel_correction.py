"""First-order correction of kernel gradients, and the velocity's gradient by it."""

import jax.numpy as jnp

from ..at_ghosts import Otherwise, Same
from ..pairs import PairTerm
from ..symmetric import inverse, times
from ..vector import Vector
from .base import Effect
from .density_diffusion import RENORMALISATION, renormalisation


def raw_velocity_gradient(pair, i, j):
    """(u_j - u_i) (x) grad_i W_ij V_j, row by row"""
    gradient = pair.gradient
    return Vector(a * b for a in j.velocity - i.velocity for b in gradient)


class KernelCorrection(Effect):
    """Fields that make differences of a linear field exact (Randles and Libersky 1996):

        L_i = [sum_j (x_j - x_i) (x) grad_i W_ij V_j]^-1,
        <grad u>_i = sum_j (u_j - u_i) (x) L_i grad_i W_ij V_j,

    ghosts and their velocities included. Gives `correction`, the upper triangle of L (1 where too
    few neighbours leave none), and `velocity_gradient` (N, n, n) [1/s], rows by component.
    """

    def geometry_terms(self, context):
        return (
            RENORMALISATION,
            PairTerm("wall_renormalisation", (), None, Otherwise((), renormalisation)),
            PairTerm("raw_velocity_gradient", ("velocity",), raw_velocity_gradient, Same()),
        )

    def fields(self, context, fields, sums):
        moment = sums["renormalisation"]
        if "wall_renormalisation" in sums:
            moment = moment + sums["wall_renormalisation"]
        correction = inverse(moment, singular=1.0)
        count, dim = fields["velocity"].shape
        raw = sums["raw_velocity_gradient"].reshape(count, dim, dim)
        rows = [times(correction, raw[:, k]) for k in range(dim)]
        return {"correction": correction, "velocity_gradient": jnp.stack(rows, axis=1)}
