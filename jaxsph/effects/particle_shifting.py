"""Particle shifting: a small extra transport velocity that keeps particles evenly spread."""

from dataclasses import dataclass

import jax.numpy as jnp

from ..at_ghosts import Same
from ..pairs import PairTerm
from .base import Effect


@dataclass(frozen=True)
class ShiftingSum:
    """[1 + chi W_ij / W(dx)]^xi grad_i W_ij V_j with xi = 4"""

    chi_over_w: float

    def __call__(self, pair, i, j):
        weight = 1.0 + self.chi_over_w * pair.kernel
        weight = weight * weight
        return pair.gradient * (weight * weight)


def shifting_term(space) -> PairTerm:
    """The sum that the shift velocity follows."""
    return PairTerm("shifting_sum", (), ShiftingSum(0.2 / space.kernel_at_spacing), Same())


def shift_velocity(total, space, speed):
    """du [m/s] from the sums (N, n) and the reference speed U = c0 Ma [m/s]."""
    return limited(-2.0 * space.smoothing_length * speed * total, speed)


def limited(raw, speed):
    """Shift velocities (N, n), the longer ones shortened to half the reference speed [m/s]."""
    squared = jnp.sum(raw * raw, axis=1)
    limit = 0.5 * speed
    fast = squared > limit**2
    scale = jnp.where(fast, limit / jnp.sqrt(jnp.where(fast, squared, 1.0)), 1.0)
    return scale[:, None] * raw


class ParticleShifting(Effect):
    """dx_i/dt = u_i + du_i, with the shift velocity du_i (paper, eq. for particle shifting):

        du*_i = -2 h c0 Ma sum_j [1 + chi W_ij / W(dx)]^xi grad_i W_ij V_j,
        du_i = min(|du*_i|, U/2) du*_i / |du*_i|,    chi = 0.2, xi = 4.

    The bracket is as the paper prints it; Sun et al. (2019) put the exponent on W_ij / W(dx) alone.
    The norm is guarded, so that a particle without shift has a derivative.
    """

    def on_fixed_points(self):
        return ()  # points are spread as they are

    def geometry_terms(self, context):
        return (shifting_term(context.space),)

    def fields(self, context, fields, sums):
        speed = context.fluid.reference_speed
        return {"shift_velocity": shift_velocity(sums["shifting_sum"], context.space, speed)}

    def rates(self, context, fields, sums):
        return {"position": fields["shift_velocity"]}
