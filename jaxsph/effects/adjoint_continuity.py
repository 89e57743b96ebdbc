"""Conservation of mass, at walls the adjoint of the pressure force."""

from dataclasses import replace

from ..at_ghosts import Otherwise
from ..pairs import PairTerm
from .base import Effect
from .continuity import VELOCITY_DIVERGENCE
from .wall_pressure import GHOST_WEIGHT, per_weight


def ghost_flux(pair, i, j):
    """u_j . grad_i W_ij V_j"""
    return j.velocity.dot(pair.gradient)


def moving_ghost_flux(pair, i, j):
    """(u_j - u_w) . grad_i W_ij V_j, u_w the velocity of the wall at i"""
    return (j.velocity - i.wall_velocity).dot(pair.gradient)


def wall_divergence(pair, i, j):
    """-u_i . grad_i W_ij V_j, and the particle's share of what the ghost gathered"""
    return _handed(pair, i, j) - i.velocity.dot(pair.gradient)


def moving_wall_divergence(pair, i, j):
    """-(u_i - u_w) . grad_i W_ij V_j, and the share"""
    return _handed(pair, i, j) - (i.velocity - j.wall_velocity).dot(pair.gradient)


def _handed(pair, i, j):
    """F_j W_ij V_j / V_i"""
    return j.gathered_flux * (pair.kernel * j.volume / i.volume)


class AdjointContinuity(Effect):
    """drho_i/dt = -rho_i D_i, D the negative adjoint of `PressureForce` with `WallPressure`:

        D_i = sum_j (u_j - u_i) . grad_i W_ij V_j
              - sum_g u_i . grad_i W_ig V_g + 1/V_i sum_g w_gi V_g F_g,
        F_g = sum_j u_j . grad_g W_gj V_j,    w_gi = W_gi / sum_k W_gk.

    A ghost's pressure is the mean sum_k w_gk p_k over the particles near it; so each ghost gathers
    the flux of its neighbours and hands it back by the same weights, and pressure and density only
    exchange kinetic for acoustic energy, in corners too, where the reflection of `Continuity` pumps
    (docs, "the consistent scheme"). The speed of a wall along itself is not in it. Where walls move
    across themselves with u_w, u is taken less u_w.
    """

    def ghost_terms(self, context):
        if context.bodies is None:
            return (GHOST_WEIGHT, PairTerm("ghost_flux", ("velocity",), ghost_flux))
        reads = ("velocity", "wall_velocity")
        return (GHOST_WEIGHT, PairTerm("ghost_flux", reads, moving_ghost_flux))

    def ghost_fields(self, context, ghosts, sums):
        mean = per_weight(sums["ghost_flux"], sums["ghost_weight"], context.space)
        return {"gathered_flux": mean}

    def rate_terms(self, context):
        handed = Otherwise(("gathered_flux",), wall_divergence)
        if context.bodies is not None:
            handed = Otherwise(("gathered_flux", "wall_velocity"), moving_wall_divergence)
        return (replace(VELOCITY_DIVERGENCE, ghost=handed),)

    def rates(self, context, fields, sums):
        return {"density": -fields["density"] * sums["velocity_divergence"]}
