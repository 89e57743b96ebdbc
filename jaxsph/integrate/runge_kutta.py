"""The classical Runge-Kutta step."""

from __future__ import annotations

from typing import final

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from .stepper import Stepper

_NODES = np.array([0.0, 0.5, 0.5, 1.0])
_WEIGHTS = np.array([1.0, 2.0, 2.0, 1.0]) / 6.0


def rk4_step(rates, time, state, time_step):
    """y + dt/6 (k1 + 2 k2 + 2 k3 + k4) of dy/dt = rates(t, y) (paper, eq. Runge-Kutta).

    The stages are a `lax.scan`, so that `rates` is compiled once, not four times.
    """

    def stage(carry, coefficients):
        slope, new = carry
        node, weight = coefficients
        ahead = node * time_step
        here = jax.tree.map(lambda y, k: y + ahead * k, state, slope)
        slope = rates(time + ahead, here)
        gained = weight * time_step
        return (slope, jax.tree.map(lambda y, k: y + gained * k, new, slope)), None

    coefficients = (jnp.asarray(_NODES, time.dtype), jnp.asarray(_WEIGHTS, time.dtype))
    (_, new), _ = lax.scan(stage, (jax.tree.map(jnp.zeros_like, state), state), coefficients)
    return new


@final
class RK4(Stepper):
    """The classical Runge-Kutta method of fourth order; the limits of steps are made for it."""

    def step(self, rates, time, state, time_step):
        return rk4_step(rates, time, state, time_step)
