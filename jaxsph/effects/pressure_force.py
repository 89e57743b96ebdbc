"""The pressure gradient."""

from ..pairs import PairTerm
from .base import Effect, WallTerm


def pressure_gradient(pair, i, j):
    """(p_i + p_j) grad_i W_ij V_j"""
    return pair.gradient * (i.pressure + j.pressure)


class PressureForce(Effect):
    """du_i/dt = -1/rho_i sum_j (p_i + p_j) grad_i W_ij V_j (paper, momentum, first sum)."""

    def rate_terms(self, space):
        return (PairTerm("pressure_gradient", ("pressure",), pressure_gradient),)

    def wall_rate_terms(self, space):
        return (WallTerm("pressure_gradient", ("pressure",), ("pressure",), pressure_gradient),)

    def rates(self, context, fields, sums):
        return {"velocity": -sums["pressure_gradient"] / fields["density"][:, None]}
