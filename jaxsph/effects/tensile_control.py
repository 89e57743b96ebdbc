"""Control of the tensile instability."""

import jax.numpy as jnp

from .base import Effect
from .kernel_gradient import KERNEL_GRADIENT


class TensileControl(Effect):
    """Turns p_i + p_j of the pressure force into p_j - p_i where pressure is negative:

        du_i/dt = s_i 2 min(p_i, 0) / rho_i sum_j grad_i W_ij V_j  (Sun et al. 2018).

    Under tension the sum of pressures pulls particles into clumps; the difference does not. It
    does not conserve momentum exactly. Near a free surface, where s (`interior`, of `FreeSurface`
    before it) is zero, the sum stays, as it gives the surface its boundary condition; a scene
    without `FreeSurface` has s = 1.
    """

    def geometry_terms(self, context):
        return (KERNEL_GRADIENT,)

    def fields(self, context, fields, sums):
        tension = 2.0 * jnp.minimum(fields["pressure"], 0.0) / fields["density"]
        tension = tension * fields.get("interior", jnp.ones_like(tension))
        return {"tensile_release": tension[:, None] * sums["kernel_gradient"]}

    def rates(self, context, fields, sums):
        return {"velocity": fields["tensile_release"]}
