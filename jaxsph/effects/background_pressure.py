"""Background pressure."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from .base import Effect
from .kernel_gradient import KERNEL_GRADIENT


class BackgroundPressure(Effect):
    """du_i/dt = -2 p_b / rho_i sum_j grad_i W_ij V_j: the pressure force of a constant p_b.

    Zero for particles that are evenly spread; else it evens them out and keeps the total pressure
    positive. Not for free surfaces, which it would blow apart.

    Args:
        pressure: p_b [Pa].
    """

    pressure: Float[Array, ""] = eqx.field(converter=jnp.asarray)

    def geometry_terms(self, context):
        return (KERNEL_GRADIENT,)

    def fields(self, context, fields, sums):
        strength = -2.0 * self.pressure / fields["density"]
        return {"evening_out": strength[:, None] * sums["kernel_gradient"]}

    def rates(self, context, fields, sums):
        return {"velocity": fields["evening_out"]}
