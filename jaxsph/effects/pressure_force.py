"""The pressure gradient."""

from ..at_ghosts import Same
from ..pairs import PairTerm
from .base import Effect


def pressure_gradient(pair, i, j):
    """(p_i + p_j) grad_i W_ij V_j"""
    return pair.gradient * (i.pressure + j.pressure)


class PressureForce(Effect):
    """du_i/dt = -1/rho_i sum_j (p_i + p_j) grad_i W_ij V_j (paper, momentum, first sum)."""

    def rate_terms(self, context):
        return (PairTerm("pressure_gradient", ("pressure",), pressure_gradient, Same()),)

    def rates(self, context, fields, sums):
        return {"velocity": -sums["pressure_gradient"] / fields["density"][:, None]}
