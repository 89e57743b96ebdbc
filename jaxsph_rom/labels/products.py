"""Products of coordinates and inputs."""

from __future__ import annotations

from itertools import combinations_with_replacement

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

_DEGREE = 3


def products(
    coordinates: Float[Array, " modes"], inputs: Float[Array, " inputs"]
) -> Float[Array, " products"]:
    """m(a, p) = (1, a_j, a_j a_k, a_j a_k a_l, p_q, p_q a_j) with j <= k <= l."""
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
