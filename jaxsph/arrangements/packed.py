"""Particle packing."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import final

import jax
import jax.numpy as jnp
from jax import lax

from ..compiled import compiled
from ..full_model import refresh_list
from ..neighbors import NeighborSearch
from ..pairs import PairTerm, Space, pair_sum
from .base import Arrangement
from .jittered_lattice import JitteredLattice

_STEP = 1.0  # times dx over the packing speed
_DAMPING = 0.1  # times the packing speed over dx
_SKIN = 0.65  # times dx


def volume_gradient(pair, i, j):
    """grad_i W_ij V_j"""
    return pair.gradient


_TERMS = (PairTerm("volume_gradient", (), volume_gradient),)


@final
@dataclass(frozen=True)
class Packed(Arrangement):
    """The particle packing algorithm (Colagrossi, Bouscasse, Antuono and Marrone 2012).

    Particles, first on a jittered lattice, are driven towards an even spread by

        du_i/dt = -beta sum_j grad_i W_ij V_0 - zeta u_i,    dx_i/dt = u_i,

    until the root mean square of dx |sum_j grad W V_0| falls below `tolerance`, or `iterations`
    are done.

    Args:
        seed: of the first jitter.
        tolerance: residual at which to stop; about 1e-2 is where a jittered lattice starts.
        iterations: at most.
    """

    seed: int = 0
    tolerance: float = 1e-5
    iterations: int = 1000

    def positions(self, space):
        return _packed(self, space, jnp.zeros(()).dtype)

    def pack(self, space):
        """Packed positions, the residual reached and the number of iterations it took.

        Raises:
            ValueError: if the box is closed in a direction, as packing knows no walls.
        """
        if not all(space.box.periodic):
            raise ValueError(
                "arrangement: packing needs a box that is periodic all round; between walls start "
                "on a lattice or a jittered lattice."
            )
        start = JitteredLattice(seed=self.seed).positions(space)
        dx = space.spacing
        search = NeighborSearch.allocate(start, space.box, space.support, _SKIN * dx, margin=1.3)
        volume = jnp.full(start.shape[0], dx**space.box.dim, start.dtype)

        def residual(force):
            return dx * jnp.sqrt(jnp.mean(jnp.sum(force**2, axis=1)))

        def unfinished(carry):
            usable = ~carry[2].overflow  # stop at a list that overflows, so that it is seen
            return usable & (carry[-2] > self.tolerance) & (carry[-1] < self.iterations)

        def step(carry):
            position, velocity, neighbors, _, count = carry
            speed = jnp.sqrt(jnp.max(jnp.sum(velocity**2, axis=1)))
            neighbors = refresh_list(search, neighbors, position, 1.5 * speed * _STEP * dx)
            fields = {"position": neighbors.sort(position), "volume": volume}
            force = neighbors.unsort(pair_sum(_TERMS, fields, space, neighbors)["volume_gradient"])
            # unit packing speed sqrt(beta): times are lengths
            velocity = velocity - _STEP * dx * (force + _DAMPING / dx * velocity)
            position = space.box.wrap(position + _STEP * dx * velocity)
            return position, velocity, neighbors, residual(force), count + 1

        @compiled
        def run(position):
            infinite = jnp.asarray(jnp.inf, position.dtype)
            carry = (position, jnp.zeros_like(position), search.build(position), infinite, 0)
            return lax.while_loop(unfinished, step, carry)

        position, _, neighbors, reached, count = jax.block_until_ready(run(start))
        if bool(neighbors.overflow):
            raise ValueError("packing: particles clumped; the box is too small for the spacing.")
        return position, float(reached), int(count)


@lru_cache(maxsize=8)
def _packed(arrangement: Packed, space: Space, dtype):
    """Scenes that differ in their fluid only share one packing."""
    return arrangement.pack(space)[0]
