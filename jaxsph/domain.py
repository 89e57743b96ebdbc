"""The box that holds the flow."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float


@dataclass(frozen=True)
class Box:
    """An axis-aligned box in n = 2 or 3 dimensions, periodic in the directions that say so.

    The box is structure, not data: it is hashable and enters compiled programs as constants.

    Args:
        lower, upper: corners [m], one number per direction.
        periodic: per direction, whether opposite faces are one.

    Raises:
        ValueError: if the corners do not span a box of 2 or 3 dimensions.
    """

    lower: tuple[float, ...]
    upper: tuple[float, ...]
    periodic: tuple[bool, ...]

    def __post_init__(self):
        for name in ("lower", "upper"):  # not numpy's floats, whose dtype would spread
            object.__setattr__(self, name, tuple(map(float, getattr(self, name))))
        if not (len(self.lower) == len(self.upper) == len(self.periodic) in (2, 3)):
            raise ValueError(
                f"Box: lower, upper and periodic need 2 or 3 entries each, got {self}."
            )
        if any(not 0.0 < b - a < np.inf for a, b in zip(self.lower, self.upper, strict=True)):
            raise ValueError(f"Box: every upper must exceed its lower, both finite, got {self}.")

    @classmethod
    def unit_periodic(cls, dim: int) -> Box:
        """The periodic unit square or cube."""
        return cls((0.0,) * dim, (1.0,) * dim, (True,) * dim)

    @property
    def dim(self) -> int:
        return len(self.lower)

    @property
    def lengths(self) -> tuple[float, ...]:
        return tuple(b - a for a, b in zip(self.lower, self.upper, strict=True))

    @property
    def volume(self) -> float:
        return float(np.prod(self.lengths))

    def minimum_image(self, difference: Array, axis: int) -> Array:
        """One component of a separation [m], taken to the nearest periodic image."""
        if not self.periodic[axis]:
            return difference
        length = self.lengths[axis]
        return difference - length * jnp.round(difference * (1.0 / length))

    def displacement(
        self, start: Float[Array, "*batch dim"], end: Float[Array, "*batch dim"]
    ) -> Float[Array, "*batch dim"]:
        """The separation end - start [m] by the nearest periodic image."""
        difference = end - start
        return jnp.stack(
            [self.minimum_image(difference[..., k], k) for k in range(self.dim)], axis=-1
        )

    @partial(jax.jit, static_argnums=0, inline=True)
    def wrap(self, position: Float[Array, "*batch dim"]) -> Float[Array, "*batch dim"]:
        """Positions [m] brought back into the box along its periodic directions."""
        columns = []
        for k in range(self.dim):
            x = position[..., k]
            if self.periodic[k]:
                length = self.lengths[k]
                x = x - length * jnp.floor((x - self.lower[k]) * (1.0 / length))
            columns.append(x)
        return jnp.stack(columns, axis=-1)
