"""The lattice with random displacements."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import final

import jax

from .base import Arrangement
from .lattice import Lattice


@final
@dataclass(frozen=True)
class JitteredLattice(Arrangement):
    """A lattice whose particles are moved by up to `amplitude` dx in each direction, uniformly.

    Args:
        amplitude: of the displacement, in spacings.
        seed: of the random numbers.
    """

    amplitude: float = 0.2
    seed: int = 0

    def positions(self, space):
        return self._moved(Lattice().positions(space), space)

    @partial(jax.jit, static_argnums=(0, 2))
    def _moved(self, lattice, space):
        jitter = jax.random.uniform(
            jax.random.key(self.seed), lattice.shape, lattice.dtype, minval=-1.0, maxval=1.0
        )
        moved = lattice + self.amplitude * space.spacing * jitter
        return space.box.wrap(moved) if all(space.box.periodic) else moved
