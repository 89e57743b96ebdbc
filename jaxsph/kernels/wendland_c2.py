"""The Wendland C2 kernel."""

from dataclasses import dataclass
from math import pi
from typing import final

import jax.numpy as jnp

from jaxsph.kernels.base import Kernel


@final
@dataclass(frozen=True)
class WendlandC2(Kernel):
    """Wendland C2 kernel, twice continuously differentiable, in dimensions 2 and 3; q = r / h.

        W    =    a / h^n       (1 - q/2)^4 (1 + 2q),   q <= 2
        W'/r = -5 a / h^(n + 2) (1 - q/2)^3,            a = 7 / (4 pi), 21 / (16 pi)

    Source: Wendland, Advances in Computational Mathematics 4 (1995), 389-396.
    """

    support = 2.0
    normalisation = {2: 7.0 / (4.0 * pi), 3: 21.0 / (16.0 * pi)}

    def value(self, r, h, dim):
        a = self.scale(h, dim)
        t = jnp.maximum(1.0 - r * (0.5 / h), 0.0)
        t2 = t * t
        return t2 * t2 * (a + r * (2.0 * a / h))

    def gradient_over_r(self, r, h, dim):
        t = jnp.maximum(1.0 - r * (0.5 / h), 0.0)
        return (-5.0 * self.scale(h, dim) / h**2) * (t * t * t)
