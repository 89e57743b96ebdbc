"""Rates that are cubic in the coordinates."""

from __future__ import annotations

from typing import final

from jaxtyping import Array, Float

from .inputs import Inputs
from .label_system import LabelSystem
from .products import products


@final
class CubicSystem(LabelSystem):
    """da_i/dt = sum_k W_ik m_k(a, p), and what else is known of the flow by the same products:

        m = (1, a_j, a_j a_k, a_j a_k a_l, p_q, p_q a_j),    b = D m,

    with j <= k <= l and p(t; theta) the `Inputs`: tensors up to third order, as a wave's frequency
    changes with the square of its amplitude. The cost is M^4, whatever the number of particles.

    Args:
        weights: W (M, products).
        recovery: D (R, products).
        inputs: p.
    """

    weights: Float[Array, "modes products"]
    recovery: Float[Array, "recovered products"]
    inputs: Inputs

    @property
    def size(self) -> int:
        return self.weights.shape[0]

    def rates(
        self,
        time: Float[Array, ""],
        coordinates: Float[Array, " modes"],
        values: Float[Array, " coefficients"],
    ) -> Float[Array, " modes"]:
        """da/dt."""
        return self.weights @ products(coordinates, self.inputs(time, values))
