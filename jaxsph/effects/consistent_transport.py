"""What a shifted particle meets on its way: the fields' own gradients."""

import jax.numpy as jnp

from ..ramps import ramp
from ..symmetric import along
from .adjoint_pressure import WALL_SHARE
from .base import Effect, given

_NEAR = (0.95, 1.0)  # of the kernel's sum that is fluid's


class ConsistentTransport(Effect):
    """Transport of momentum and density by the shift velocity:

        du_i/dt = f_i <grad u>_i du_i,  drho_i/dt = f_i du_i . <grad rho>_i,

    the shift-velocity terms in difference form: exact for linear fields, and nothing where the
    field is uniform. f falls to zero where ghosts hold more than a twentieth of the kernel's sum:
    the gradient of a layer thinner than the kernel, as under a lid, is not known there.

    Needs the shift velocity, `KernelCorrection` and `DensityDiffusion` before it.
    """

    def on_fixed_points(self):
        return ()  # nothing is shifted there

    def geometry_terms(self, context):
        return (WALL_SHARE,)

    def fields(self, context, fields, sums):
        given(fields, "velocity_gradient", self, "KernelCorrection")
        given(fields, "density_gradient", self, "DensityDiffusion")
        shift = given(fields, "shift_velocity", self, "StrainShifting or ParticleShifting")
        if "wall_share" not in sums:
            return {"carried_shift": shift}
        return {"carried_shift": ramp(1.0 - sums["wall_share"], *_NEAR)[:, None] * shift}

    def rates(self, context, fields, sums):
        shift = fields["carried_shift"]
        return {
            "velocity": along(fields["velocity_gradient"], shift),
            "density": jnp.sum(shift * fields["density_gradient"], axis=1),
        }
