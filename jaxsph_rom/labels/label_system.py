"""What moves a few coordinates over labels, and recovers the others."""

from __future__ import annotations

import equinox as eqx
import numpy as np
from jaxtyping import Array, Bool, Float

from jaxsph import Space

from ..points.dynamics.base import Dynamics
from .inputs import Inputs
from .products import products


class LabelSystem(Dynamics):
    """da/dt = f(t, a; theta), and what else is known of the flow by products of a,

        b = D m(a, p).

    Args:
        recovery: D (R, products).
        inputs: p.
    """

    recovery: eqx.AbstractVar[Float[Array, "recovered products"]]
    inputs: eqx.AbstractVar[Inputs]

    def recovered(
        self,
        time: Float[Array, ""],
        coordinates: Float[Array, " modes"],
        values: Float[Array, " coefficients"],
    ) -> Float[Array, " recovered"]:
        """b."""
        return self.recovery @ products(coordinates, self.inputs(time, values))

    def strayed(
        self,
        position: Float[np.ndarray, "times particles dim"],
        labels: Float[np.ndarray, "particles dim"],
        space: Space,
    ) -> Bool[np.ndarray, " times"]:
        """When particles are where the system no longer knows what moves them; never, if its rates
        are none of single particles."""
        return np.zeros(len(position), bool)
