"""Conservation of mass."""

from ..pairs import PairTerm
from .base import Effect


def velocity_divergence(pair, i, j):
    """(u_j - u_i) . grad_i W_ij V_j"""
    return (j.velocity - i.velocity).dot(pair.gradient)


VELOCITY_DIVERGENCE = PairTerm("velocity_divergence", ("velocity",), velocity_divergence)


class Continuity(Effect):
    """drho_i/dt = -rho_i sum_j (u_j - u_i) . grad_i W_ij V_j (paper, continuity, first sum)."""

    def rate_terms(self, space):
        return (VELOCITY_DIVERGENCE,)

    def rates(self, context, fields, sums):
        return {"density": -fields["density"] * sums["velocity_divergence"]}
