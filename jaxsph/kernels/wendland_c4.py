"""The Wendland C4 kernel."""

from dataclasses import dataclass
from math import pi
from typing import final

import jax.numpy as jnp

from jaxsph.kernels.base import Kernel


@final
@dataclass(frozen=True)
class WendlandC4(Kernel):
    """Wendland C4 kernel, four times continuously differentiable, in dimensions 2 and 3; q = r / h.

        W    =        a / h^n       (1 - q/2)^6 (1 + 3q + 35/12 q^2),  q <= 2
        W'/r = -14/3 a / h^(n + 2)  (1 - q/2)^5 (1 + 5/2 q),  a = 9 / (4 pi), 495 / (256 pi)

    Source: Wendland, Advances in Computational Mathematics 4 (1995), 389-396.
    """

    support = 2.0
    normalisation = {2: 9.0 / (4.0 * pi), 3: 495.0 / (256.0 * pi)}

    def value(self, r, h, dim):
        a = self.scale(h, dim)
        t = jnp.maximum(1.0 - r * (0.5 / h), 0.0)
        t2 = t * t
        return t2 * t2 * t2 * (a + r * (3.0 * a / h + r * (35.0 / 12.0 * a / h**2)))

    def gradient_over_r(self, r, h, dim):
        b = -14.0 / 3.0 * self.scale(h, dim) / h**2
        t = jnp.maximum(1.0 - r * (0.5 / h), 0.0)
        t2 = t * t
        return t2 * t2 * t * (b + r * (2.5 * b / h))
