"""Conservation of mass."""

from dataclasses import replace

from ..at_ghosts import Mirrored
from ..pairs import PairTerm
from .base import Effect


def velocity_divergence(pair, i, j):
    """(u_j - u_i) . grad_i W_ij V_j"""
    return (j.velocity - i.velocity).dot(pair.gradient)


VELOCITY_DIVERGENCE = PairTerm(
    "velocity_divergence", ("velocity",), velocity_divergence, Mirrored("velocity")
)


class Continuity(Effect):
    """drho_i/dt = -rho_i sum_j (u_j - u_i) . grad_i W_ij V_j (paper, continuity, first sum).

    At a wall of normal n a ghost answers each particle with the particle's own velocity, its normal
    part reversed: u_j - u_i = -2 (u_i . n) n. Extrapolated ghost velocities would carry the change
    of a lid's speed along the wall as a divergence, and the lid would suck particles in. Where
    walls move across themselves with u_w, the part reversed is that of u_i - u_w.
    """

    def rate_terms(self, context):
        if context.bodies is None:
            return (VELOCITY_DIVERGENCE,)
        return (replace(VELOCITY_DIVERGENCE, ghost=Mirrored("velocity", "wall_velocity")),)

    def rates(self, context, fields, sums):
        return {"density": -fields["density"] * sums["velocity_divergence"]}
