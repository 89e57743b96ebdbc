"""Particle shifting as strong as the flow's own deformation."""

import jax.numpy as jnp

from ..ramps import root
from .base import Effect, given
from .particle_shifting import limited, shifting_term

_STRENGTH = 12.0  # at h = 2 dx: U where the flow changes by U over 24 dx


class StrainShifting(Effect):
    """dx_i/dt = u_i + du_i, du_i as `ParticleShifting` has it with a speed of its own for each
    particle in place of U:

        U_i = min(12 h (2 S_i : S_i)^(1/2), U),    S = (<grad u> + <grad u>^T) / 2.

    What deforms the fluid is what disorders particles, so nothing else need put them in order: a
    fluid at rest, in uniform motion or in rigid rotation is not shifted at all, and du vanishes
    with h, as Michel et al. (2022) ask of a convergent and invariant law. Needs `KernelCorrection`.
    """

    def on_fixed_points(self):
        return ()  # points are spread as they are

    def geometry_terms(self, context):
        return (shifting_term(context.space),)

    def fields(self, context, fields, sums):
        gradient = given(fields, "velocity_gradient", self, "KernelCorrection")
        fluid, space = context.fluid, context.space
        strain = 0.5 * (gradient + jnp.swapaxes(gradient, 1, 2))
        scale = space.smoothing_length / fluid.reference_speed
        rate = root(2.0 * jnp.sum((strain * scale) ** 2, axis=(1, 2)))
        speed = fluid.reference_speed * jnp.minimum(_STRENGTH * rate, 1.0)
        raw = -2.0 * space.smoothing_length * speed[:, None] * sums["shifting_sum"]
        return {"shift_velocity": limited(raw, fluid.reference_speed)}

    def rates(self, context, fields, sums):
        return {"position": fields["shift_velocity"]}
