"""The square or cubic lattice."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import jax.numpy as jnp

from .base import Arrangement


@final
@dataclass(frozen=True)
class Lattice(Arrangement):
    """Particles at the centres of equal squares or cubes of side dx.

    Where dx does not divide a side of the box, they are as much longer or shorter as a whole number
    of them needs (`Space.steps`).
    """

    def positions(self, space):
        return jnp.asarray(space.lattice())
