"""Artificial viscosity."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..at_ghosts import Same
from ..pairs import PairTerm
from .base import Effect, viscous_step_limit
from .laminar_viscosity import viscous_sum


class ArtificialViscosity(Effect):
    """du_i/dt = rho0/rho_i alpha h c0 sum_j (u_j-u_i).(x_j-x_i)/r^2 grad_i W_ij V_j

    (Antuono et al. 2010), a viscosity nu = alpha h c0 / (2 (n + 2)) that vanishes with resolution.
    It acts on all pairs, not on approaching ones alone.

    Args:
        alpha: strength, conventionally 0.01 to 0.1.
    """

    alpha: Float[Array, ""] = eqx.field(converter=jnp.asarray)

    def step_limit(self, fluid, space):
        viscosity = self.alpha * space.smoothing_length * fluid.sound_speed
        return viscous_step_limit(viscosity / (2 * (space.box.dim + 2)), space)

    def rate_terms(self, context):
        return (PairTerm("viscous_sum", ("velocity",), viscous_sum, Same()),)

    def rates(self, context, fields, sums):
        fluid, h = context.fluid, context.space.smoothing_length
        factor = self.alpha * h * fluid.sound_speed * fluid.reference_density / fields["density"]
        return {"velocity": factor[:, None] * sums["viscous_sum"]}
