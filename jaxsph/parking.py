"""Where particles wait that are in no flow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from .domain import Box


@final
@dataclass(frozen=True)
class Parking:
    """A place outside a box, for all particles that are in no flow: they take no part in any sum.

    It is as far from the box's lower end along one of its closed axes as the box is long, so that
    positions alone tell which particles are there. Structure, not data.

    Args:
        box: that the flow is in.
        axis: along which it is closed.

    Raises:
        ValueError: if the box is periodic along that axis.
    """

    box: Box
    axis: int = 0

    def __post_init__(self):
        if self.box.periodic[self.axis]:
            raise ValueError(
                f"parking: the box is periodic along axis {self.axis}, and has no outside there; "
                "name an axis along which it is closed."
            )

    @property
    def place(self) -> tuple[float, ...]:
        """Where they are [m]."""
        middle = [0.5 * (a + b) for a, b in zip(self.box.lower, self.box.upper, strict=True)]
        middle[self.axis] = self.box.lower[self.axis] - self.box.lengths[self.axis]
        return tuple(middle)

    def holds(self, position: Float[Array, "particles dim"]) -> Bool[Array, " particles"]:
        """Which particles are there, by their positions [m]."""
        border = self.box.lower[self.axis] - 0.5 * self.box.lengths[self.axis]
        return jnp.asarray(position)[:, self.axis] < border


def flowing(
    position: Float[Array, "particles dim"], parking: Parking | None
) -> Float[Array, "flowing dim"]:
    """The places [m] of particles that are not parked (outside jit)."""
    return position if parking is None else position[~np.asarray(parking.holds(position))]
