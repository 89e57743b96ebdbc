"""The quintic spline kernel."""

from dataclasses import dataclass
from math import pi
from typing import final

import jax.numpy as jnp

from jaxsph.kernels.base import Kernel


@final
@dataclass(frozen=True)
class QuinticSpline(Kernel):
    """Quintic B-spline kernel, four times continuously differentiable, in dimensions 2 and 3.

    With q = r / h, (x)+ = max(x, 0), a = 7 / (478 pi) and 1 / (120 pi):

        W  =    a / h^n       [(3 - q)+^5 - 6 (2 - q)+^5 + 15 (1 - q)+^5]
        W' = -5 a / h^(n + 1) [(3 - q)+^4 - 6 (2 - q)+^4 + 15 (1 - q)+^4]

    Source: Morris, Publications of the Astronomical Society of Australia 13 (1996), 97-102.
    """

    support = 3.0
    normalisation = {2: 7.0 / (478.0 * pi), 3: 1.0 / (120.0 * pi)}

    def value(self, r, h, dim):
        a = self.scale(h, dim)
        q = r * (1.0 / h)
        t3, t2, t1 = (jnp.maximum(knot - q, 0.0) for knot in (3.0, 2.0, 1.0))
        return a * (_fourth(t3) * t3 - 6.0 * _fourth(t2) * t2 + 15.0 * _fourth(t1) * t1)

    def gradient_over_r(self, r, h, dim):
        # On q < 1 the spline's W'/q is the cubic -120 + 120 q^2 - 50 q^3: dividing the truncated
        # powers by q there would lose all digits as q -> 0. So q is split at 1; `inner` is the
        # cubic less its value at 1 (hence zero beyond), `outer` is W'/q from 1 on.
        b = self.scale(h, dim) / h**2
        q = r * (1.0 / h)
        q_in, q_out = jnp.minimum(q, 1.0), jnp.maximum(q, 1.0)
        t3, t2 = jnp.maximum(3.0 - q_out, 0.0), jnp.maximum(2.0 - q_out, 0.0)
        inner = q_in * q_in * (120.0 - 50.0 * q_in) - 70.0
        outer = (30.0 * _fourth(t2) - 5.0 * _fourth(t3)) / q_out
        return b * (inner + outer)


def _fourth(x):
    square = x * x
    return square * square
