"""The reduced model on reference points, in the protocol of the time loop."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsph.integrate import Fault, FaultCode, Model

from .energy_bound import EnergyBound
from .quadratic_system import QuadraticSystem


class TensorModel(Model):
    """da/dt of a `QuadraticSystem` at a viscosity; its state are the coordinates a (M,).

    It runs in the full model's loop at a cost of M^3 a step, whatever the number of particles. What
    is recorded are the coordinates; fields are made of these on demand.

    Args:
        system: constant, linear and quadratic part.
        viscosity: nu [m^2/s], a leaf to sweep or to differentiate.
        bound: on the energy; without one a run is only known to be lost once it is not finite.
    """

    system: QuadraticSystem
    viscosity: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    bound: EnergyBound | None = None

    def prepare(self, state):
        return None

    def refresh(self, auxiliary, state, time_step):
        return auxiliary

    def rates(self, time, state, auxiliary):
        return self.system(state, self.viscosity)

    def finish(self, state):
        return state

    def inspect(self, step, state, auxiliary):
        checks = [(FaultCode.NOT_FINITE, ~jnp.all(jnp.isfinite(state)), -1)]
        if self.bound is not None:
            checks.append((FaultCode.ENERGY_OUT_OF_BOUNDS, self.bound.exceeded(state), -1))
        return Fault.first_of(step, *checks)

    def observe(self, state):
        return state
