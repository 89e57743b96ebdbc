"""The reduced model on reference points, in the protocol of the time loop."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsph.integrate import Fault, FaultCode, Model

from .base import Dynamics
from .energy_bound import EnergyBound


class PointsModel(Model):
    """da/dt of a `Dynamics` at its coefficients; its state are the coordinates a (M,).

    It runs in the full model's loop, by tensors at a cost of M^3 a step, whatever the number of
    particles. What is recorded are the coordinates; fields are made of these on demand.

    Args:
        dynamics: what moves the coordinates.
        values: theta of the operators, a leaf to sweep or to differentiate; a viscosity [m^2/s],
            say.
        bound: on the energy; without one a run is only known to be lost once it is not finite.
    """

    dynamics: Dynamics
    values: Float[Array, "*coefficients"] = eqx.field(converter=jnp.asarray)
    bound: EnergyBound | None = None

    def prepare(self, state):
        return None

    def refresh(self, auxiliary, state, time_step):
        return auxiliary

    def rates(self, time, state, auxiliary):
        return self.dynamics.rates(time, state, self.values)

    def finish(self, state):
        return state

    def inspect(self, step, state, auxiliary):
        checks = [(FaultCode.NOT_FINITE, ~jnp.all(jnp.isfinite(state)), -1)]
        if self.bound is not None:
            checks.append((FaultCode.ENERGY_OUT_OF_BOUNDS, self.bound.exceeded(state), -1))
        return Fault.first_of(step, *checks)

    def observe(self, state):
        return state
