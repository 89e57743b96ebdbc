"""Shifting that keeps off the free surface."""

import jax.numpy as jnp

from .base import Effect


class SurfaceShifting(Effect):
    """Takes from the shift velocity what would push particles through a free surface:

        du_i <- c_i [du_i - (1 - s_i) (du_i . n_i) n_i],

    n the surface's normal, s (`interior`) from 0 at the surface to 1 inside, c (`coherent`) zero
    for particles that fly alone: tangential shifting of the delta-plus scheme (Sun et al. 2017,
    2019), with ramps in place of thresholds. Stands behind `ParticleShifting` and `FreeSurface`,
    whose fields it needs.
    """

    def fields(self, context, fields, sums):
        shift, normal = fields["shift_velocity"], fields["surface_normal"]
        across = (1.0 - fields["interior"]) * jnp.sum(shift * normal, axis=1)
        kept = shift - across[:, None] * normal
        return {"shift_velocity": fields["coherent"][:, None] * kept}
