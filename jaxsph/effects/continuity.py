"""Conservation of mass."""

from ..pairs import PairTerm
from .base import Effect, WallTerm


def velocity_divergence(pair, i, j):
    """(u_j - u_i) . grad_i W_ij V_j"""
    return (j.velocity - i.velocity).dot(pair.gradient)


def reflected_divergence(pair, i, j):
    """-2 (u_i . n_j) (n_j . grad_i W_ij) V_j"""
    return i.velocity.dot(j.normal) * j.normal.dot(pair.gradient) * -2.0


def moving_divergence(pair, i, j):
    """-2 ((u_i - u_w) . n_j) (n_j . grad_i W_ij) V_j, u_w the velocity of the wall at j"""
    approach = (i.velocity - j.wall_velocity).dot(j.normal)
    return approach * j.normal.dot(pair.gradient) * -2.0


VELOCITY_DIVERGENCE = PairTerm("velocity_divergence", ("velocity",), velocity_divergence)
WALL_DIVERGENCE = WallTerm("velocity_divergence", ("velocity",), ("normal",), reflected_divergence)

MOVING_DIVERGENCE = WallTerm(
    "velocity_divergence", ("velocity",), ("normal", "wall_velocity"), moving_divergence
)


class Continuity(Effect):
    """drho_i/dt = -rho_i sum_j (u_j - u_i) . grad_i W_ij V_j (paper, continuity, first sum).

    At a wall of normal n a ghost answers each particle with the particle's own velocity, its normal
    part reversed: u_j - u_i = -2 (u_i . n) n. Extrapolated ghost velocities would carry the change
    of a lid's speed along the wall as a divergence, and the lid would suck particles in. Where
    walls move across themselves with u_w, the part reversed is that of u_i - u_w.
    """

    def rate_terms(self, space):
        return (VELOCITY_DIVERGENCE,)

    def wall_rate_terms(self, space):
        return (WALL_DIVERGENCE,)

    def moving_wall_rate_terms(self, space):
        return (MOVING_DIVERGENCE,)

    def rates(self, context, fields, sums):
        return {"density": -fields["density"] * sums["velocity_divergence"]}
