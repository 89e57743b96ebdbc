"""Laminar viscosity."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..at_ghosts import Same
from ..pairs import PairTerm
from .base import Effect, viscous_step_limit
from .isotropic_viscosity import IsotropicViscosity


def viscous_sum(pair, i, j):
    """(u_j - u_i) . (x_j - x_i) / r^2 grad_i W_ij V_j"""
    approach = (j.velocity - i.velocity).dot(pair.separation)
    return pair.gradient * (approach / pair.squared_distance)


class LaminarViscosity(Effect):
    """du_i/dt = rho0/rho_i K sum_j (u_j-u_i).(x_j-x_i)/r^2 grad_i W_ij V_j, K = 2(n+2) nu.

    The Monaghan-Gingold form that conserves angular momentum (paper, momentum, second sum).

    Args:
        viscosity: kinematic viscosity nu [m^2/s].
    """

    viscosity: Float[Array, ""] = eqx.field(converter=jnp.asarray)

    def on_fixed_points(self):
        return (IsotropicViscosity(self.viscosity),)  # on a lattice the more accurate form

    def step_limit(self, fluid, space):
        return viscous_step_limit(self.viscosity, space)

    def rate_terms(self, context):
        return (PairTerm("viscous_sum", ("velocity",), viscous_sum, Same()),)

    def rates(self, context, fields, sums):
        factor = 2.0 * (context.space.box.dim + 2) * self.viscosity
        factor = factor * context.fluid.reference_density / fields["density"]
        return {"velocity": factor[:, None] * sums["viscous_sum"]}
