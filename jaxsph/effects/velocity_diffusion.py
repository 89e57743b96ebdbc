"""Numerical diffusion of what a linear velocity field leaves over."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..pairs import PairTerm
from ..symmetric import product
from .base import Effect, given, viscous_step_limit


def velocity_diffusion(pair, i, j):
    """c_j [(u_j - u_i).x_ij - x_ij.(S_i + S_j) x_ij / 2] grad_i W_ij / r^2 V_j, x_ij = x_j - x_i"""
    apart = pair.separation
    linear = apart.dot(product(i.strain + j.strain, apart)) * 0.5
    jump = (j.velocity - i.velocity).dot(apart) - linear
    return pair.gradient * (jump * j.diffused / pair.squared_distance)


class VelocityDiffusion(Effect):
    """A diffusion of velocity that linear fields do not feel:

        du_i/dt = rho0/rho_i 2 delta h c0 c_i sum_j c_j
            [(u_j - u_i) . x_ij - x_ij . (S_i + S_j) x_ij / 2] grad_i W_ij / r^2 V_j,

    x_ij = x_j - x_i, S the symmetric part of the velocity's gradient: Monaghan's artificial
    viscosity of what a linear reconstruction from either side leaves (as in Vila 1999), the
    counterpart of `DensityDiffusion` for velocity. Linear fields, rotation among them, do not feel
    it; noise from particle to particle decays within some h / (delta c0), and waves lose little to
    it. c (`coherent`, of `FreeSurface` before it) spares particles that fly alone. It conserves
    linear and angular momentum. Needs `KernelCorrection`.

    Args:
        delta: strength.
    """

    delta: Float[Array, ""] = eqx.field(converter=jnp.asarray)

    def step_limit(self, fluid, space):
        viscosity = self.delta * space.smoothing_length * fluid.sound_speed
        return viscous_step_limit(viscosity / (space.box.dim + 2), space)

    def fields(self, context, fields, sums):
        gradient = given(fields, "velocity_gradient", self, "KernelCorrection")
        symmetric = 0.5 * (gradient + jnp.swapaxes(gradient, 1, 2))
        rows, columns = jnp.triu_indices(symmetric.shape[1])
        share = fields.get("coherent", jnp.ones_like(fields["density"]))
        return {"strain": symmetric[:, rows, columns], "diffused": share}

    def rate_terms(self, context):
        reads = ("velocity", "strain", "diffused")
        return (PairTerm("velocity_diffusion", reads, velocity_diffusion),)

    def rates(self, context, fields, sums):
        fluid, h = context.fluid, context.space.smoothing_length
        factor = 2.0 * self.delta * h * fluid.sound_speed * fields["diffused"]
        factor = factor * (fluid.reference_density / fields["density"])
        return {"velocity": factor[:, None] * sums["velocity_diffusion"]}
