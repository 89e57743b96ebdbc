"""The pressure gradient where films may lie on walls."""

from ..at_ghosts import Otherwise
from ..pairs import PairTerm
from .adjoint_continuity import gripped
from .base import Effect, given
from .pressure_force import pressure_gradient


def wall_pressure_gradient(pair, i, j):
    """(p_i + p_j) B_ij grad_i W_ij V_j"""
    return gripped(pair.gradient, j.normal, i.wall_grip) * (i.pressure + j.pressure)


class GrippedPressureForce(Effect):
    """`PressureForce`, but for a film of a single layer a wall presses along its normal alone:

        du_i/dt = -1/rho_i [sum_j (p_i + p_j) grad_i W_ij V_j
                            + sum_g (p_i + p_g) B_ig grad_i W_ig V_g]

    over particles j and ghosts g, B of `AdjointContinuity`, which it needs before it.
    """

    def rate_terms(self, context):
        across = Otherwise(("pressure", "normal"), wall_pressure_gradient)
        return (
            PairTerm("pressure_gradient", ("pressure",), pressure_gradient),
            PairTerm("wall_pressure_gradient", ("pressure", "wall_grip"), None, across),
        )

    def rates(self, context, fields, sums):
        given(fields, "wall_grip", self, "AdjointContinuity")
        gradient = sums["pressure_gradient"] + sums.get("wall_pressure_gradient", 0.0)
        return {"velocity": -gradient / fields["density"][:, None]}
