"""What density and momentum lose and gain because particles are shifted."""

from ..at_ghosts import Mirrored
from ..pairs import PairTerm
from .base import Effect


def shift_divergence(pair, i, j):
    """(du_j - du_i) . grad_i W_ij V_j"""
    return j.shift_velocity.dot(pair.gradient) - i.shift_velocity.dot(pair.gradient)


def shift_mass_flux(pair, i, j):
    """(rho_j du_j + rho_i du_i) . grad_i W_ij V_j"""
    there = j.shift_velocity.dot(pair.gradient)
    here = i.shift_velocity.dot(pair.gradient)
    return j.density * there + i.density * here


def shift_momentum_flux(pair, i, j):
    """(u_j (x) du_j + u_i (x) du_i) . grad_i W_ij V_j"""
    there = j.shift_velocity.dot(pair.gradient)
    here = i.shift_velocity.dot(pair.gradient)
    return j.velocity * there + i.velocity * here


_SHIFT = Mirrored("shift_velocity")


class ShiftingTransport(Effect):
    """The shift-velocity terms of the paper's continuity and momentum equations:

        drho_i/dt = -rho_i sum_j (du_j - du_i).grad W V_j
                    + sum_j (rho_j du_j + rho_i du_i).grad W V_j,
        du_i/dt = rho0/rho_i [ sum_j (u_j (x) du_j + u_i (x) du_i).grad W V_j
                               - u_i sum_j (du_j - du_i).grad W V_j ].

    Needs `ParticleShifting`, which makes the shift velocity du. The last sum is not pairwise
    antisymmetric: with it, total momentum is conserved only to truncation. At a wall the ghost's
    shift velocity is the particle's own, its part along the wall's normal reversed.
    """

    def on_fixed_points(self):
        return ()  # nothing is shifted there

    def rate_terms(self, context):
        shift, density, velocity = "shift_velocity", "density", "velocity"
        return (
            PairTerm("shift_divergence", (shift,), shift_divergence, _SHIFT),
            PairTerm("shift_mass_flux", (shift, density), shift_mass_flux, _SHIFT),
            PairTerm("shift_momentum_flux", (velocity, shift), shift_momentum_flux, _SHIFT),
        )

    def rates(self, context, fields, sums):
        density, divergence = fields["density"], sums["shift_divergence"]
        momentum = sums["shift_momentum_flux"] - fields["velocity"] * divergence[:, None]
        return {
            "density": sums["shift_mass_flux"] - density * divergence,
            "velocity": (context.fluid.reference_density / density)[:, None] * momentum,
        }
