"""The classical Runge-Kutta step."""

from __future__ import annotations

import jax


def rk4_step(rates, time, state, time_step):
    """y + dt/6 (k1 + 2 k2 + 2 k3 + k4) of dy/dt = rates(t, y) (paper, eq. Runge-Kutta)."""

    def moved(fraction, slope):
        step = fraction * time_step
        return jax.tree.map(lambda y, k: y + step * k, state, slope)

    half = time + 0.5 * time_step
    k1 = rates(time, state)
    k2 = rates(half, moved(0.5, k1))
    k3 = rates(half, moved(0.5, k2))
    k4 = rates(time + time_step, moved(1.0, k3))
    sixth = time_step / 6.0
    return jax.tree.map(
        lambda y, a, b, c, d: y + sixth * (a + 2.0 * (b + c) + d), state, k1, k2, k3, k4
    )
