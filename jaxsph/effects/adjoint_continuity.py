"""Conservation of mass, at walls the adjoint of the pressure force."""

from dataclasses import replace

from ..at_ghosts import Otherwise
from ..pairs import PairTerm
from ..ramps import ramp
from ..symmetric import smallest_eigenvalue
from .base import Effect
from .continuity import VELOCITY_DIVERGENCE
from .density_diffusion import RENORMALISATION
from .wall_pressure import GHOST_WEIGHT, own_volume, per_weight

_FILM = (0.02, 0.08)  # of the eigenvalue: 0 in a film of one layer, 0.085 and more in a corner


def gripped(gradient, normal, grip):
    """b g + (1 - b) (g . n) n"""
    return gradient * grip + normal * (gradient.dot(normal) * (1.0 - grip))


def ghost_flux(pair, i, j):
    """u_j . B_ji grad_i W_ij V_j"""
    return j.velocity.dot(gripped(pair.gradient, i.normal, j.wall_grip))


def moving_ghost_flux(pair, i, j):
    """(u_j - u_w) . B_ji grad_i W_ij V_j, u_w the velocity of the wall at i"""
    return (j.velocity - i.wall_velocity).dot(gripped(pair.gradient, i.normal, j.wall_grip))


def wall_divergence(pair, i, j):
    """-u_i . B_ij grad_i W_ij V_j, and the particle's share of what the ghost gathered"""
    return _handed(pair, i, j) - i.velocity.dot(gripped(pair.gradient, j.normal, i.wall_grip))


def moving_wall_divergence(pair, i, j):
    """-(u_i - u_w) . B_ij grad_i W_ij V_j, and the share"""
    apart = i.velocity - j.wall_velocity
    return _handed(pair, i, j) - apart.dot(gripped(pair.gradient, j.normal, i.wall_grip))


def _handed(pair, i, j):
    """F_j W_ij V_j / V_i"""
    return j.gathered_flux * (pair.kernel * j.volume / own_volume(i))


class AdjointContinuity(Effect):
    """drho_i/dt = -rho_i D_i, D the negative adjoint of `GrippedPressureForce` with `WallPressure`:

        D_i = sum_j (u_j - u_i) . grad_i W_ij V_j
              - sum_g u_i . B_ig grad_i W_ig V_g + 1/V_i sum_g w_gi V_g F_g,
        F_g = sum_j u_j . B_jg grad_g W_gj V_j,    w_gi = W_gi / sum_k W_gk,
        B_ig = b_i + (1 - b_i) n_g (x) n_g.

    A ghost's pressure is the mean sum_k w_gk p_k over the particles near it; so each ghost gathers
    the flux of its neighbours and hands it back by the same weights, and pressure and density only
    exchange kinetic for acoustic energy, in corners too, where the reflection of `Continuity` pumps
    (docs, "the consistent scheme"). The speed of a wall along itself is not in it. Where walls move
    across themselves with u_w, u is taken less u_w.

    In the body of fluid b_i is 1. In a film of a single layer on a wall it is 0: the wall then acts
    along its normal n_g alone. The lattice of ghosts would hold such a film, which has no
    neighbours to make up for the lattice's unevenness, against gravity. b (`wall_grip`) rises with
    the smallest eigenvalue of sum_j (x_j - x_i) (x) grad_i W_ij V_j over the fluid alone.
    """

    def geometry_terms(self, context):
        return (RENORMALISATION,)

    def fields(self, context, fields, sums):
        return {"wall_grip": ramp(smallest_eigenvalue(sums["renormalisation"]), *_FILM)}

    def ghost_terms(self, context):
        reads = ("velocity", "wall_grip", "normal")
        if context.bodies is None:
            return (GHOST_WEIGHT, PairTerm("ghost_flux", reads, ghost_flux))
        reads = (*reads, "wall_velocity")
        return (GHOST_WEIGHT, PairTerm("ghost_flux", reads, moving_ghost_flux))

    def ghost_fields(self, context, ghosts, sums):
        mean = per_weight(sums["ghost_flux"], sums["ghost_weight"], context.space)
        return {"gathered_flux": mean}

    def rate_terms(self, context):
        names = ("gathered_flux", "normal")
        handed = Otherwise(names, wall_divergence)
        if context.bodies is not None:
            handed = Otherwise((*names, "wall_velocity"), moving_wall_divergence)
        walls = PairTerm("wall_divergence", ("velocity", "wall_grip"), None, handed)
        return (replace(VELOCITY_DIVERGENCE, ghost=None), walls)

    def rates(self, context, fields, sums):
        divergence = sums["velocity_divergence"] + sums.get("wall_divergence", 0.0)
        return {"density": -fields["density"] * divergence}
