"""Rates that are cubic in the coordinates."""

from __future__ import annotations

from itertools import combinations_with_replacement
from typing import final

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..points.dynamics.base import Dynamics
from .inputs import Inputs

_DEGREE = 3


@final
class CubicSystem(Dynamics):
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

    def recovered(self, time, coordinates, values) -> Float[Array, " recovered"]:
        """b."""
        return self.recovery @ products(coordinates, self.inputs(time, values))


def products(
    coordinates: Float[Array, " modes"], inputs: Float[Array, " inputs"]
) -> Float[Array, " products"]:
    """m(a, p)."""
    size = len(coordinates)
    factors = np.full((len(_powers(size)), _DEGREE), size)  # the last one is 1
    for row, chosen in enumerate(_powers(size)):
        factors[row, : len(chosen)] = chosen
    ahead = jnp.append(coordinates, jnp.ones((), coordinates.dtype))
    own = jnp.prod(ahead[factors], axis=1)
    mixed = inputs[:, None] * ahead[None, :]
    return jnp.concatenate([own, mixed.reshape(-1)])


def _powers(size: int) -> list[tuple[int, ...]]:
    numbers = range(size)
    return [p for d in range(_DEGREE + 1) for p in combinations_with_replacement(numbers, d)]
