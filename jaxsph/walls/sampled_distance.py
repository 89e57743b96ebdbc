"""A region whose signed distance is known on a grid."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from itertools import product
from typing import final

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .region import Region


@final
@dataclass(frozen=True)
class SampledDistance(Region):
    """A region by its signed distance at the nodes of a grid, multilinear between them.

    Between nodes a distance d [m] of a surface of curvature radius R is off by at most
    n delta^2 / (8 R), delta the grid's spacing. Beyond the grid, which must hold the region and a
    margin around it, it is (d^2 + b^2)^(1/2) with b the distance to the grid and d the value at its
    edge.

    Args:
        lower: corner of the grid [m].
        spacing: delta [m].
        values: signed distances (N1, N2) or (N1, N2, N3) [m], negative inside; first axis x.

    Raises:
        ValueError: for values that are not finite, of one sign, or negative at the grid's edge.
    """

    lower: tuple[float, ...]
    spacing: float
    values: Float[np.ndarray, "..."] = field(compare=False, repr=False)
    digest: str = field(init=False, repr=False)

    def __post_init__(self):
        values = np.array(self.values, float)
        values.setflags(write=False)
        object.__setattr__(self, "lower", tuple(map(float, self.lower)))
        object.__setattr__(self, "values", values)
        content = hashlib.sha256(values.tobytes() + repr(values.shape).encode()).hexdigest()
        object.__setattr__(self, "digest", content)
        if values.ndim != len(self.lower) or min(values.shape) < 2:
            raise ValueError(
                f"SampledDistance: values of shape {values.shape} for {len(self.lower)} "
                "dimensions; give at least two nodes along each."
            )
        if not np.isfinite(values).all() or not values.min() < 0.0 < values.max():
            raise ValueError(
                "SampledDistance: values must be finite, negative in the region and positive "
                "around it."
            )
        inner = values[(slice(1, -1),) * values.ndim]
        if (values < 0.0).sum() > (inner < 0.0).sum():
            raise ValueError(
                "SampledDistance: the region reaches the grid's edge; let the grid be larger than "
                "the region on all sides."
            )

    def signed_distance(self, position):
        kind = position.dtype
        values = jnp.asarray(self.values, kind)
        place = (position - jnp.asarray(self.lower, kind)[None, :]) / self.spacing
        last = jnp.asarray([n - 1.0 for n in values.shape], kind)[None, :]
        within = jnp.clip(place, 0.0, last)
        cell = jnp.clip(jnp.floor(within), 0.0, last - 1.0)
        share, node = within - cell, cell.astype(jnp.int32)
        found = jnp.zeros(position.shape[0], kind)
        for corner in product((0, 1), repeat=values.ndim):
            weight = jnp.ones(position.shape[0], kind)
            for axis, upper in enumerate(corner):
                weight = weight * (share[:, axis] if upper else 1.0 - share[:, axis])
            at = tuple(node[:, axis] + upper for axis, upper in enumerate(corner))
            found = found + weight * values[at]
        squared = self.spacing**2 * jnp.sum((place - within) ** 2, axis=1)
        beyond = squared > 0.0
        far = jnp.sqrt(jnp.where(beyond, squared + found * found, 1.0))
        return jnp.where(beyond, far, found)
