"""Particles as a flow leaves them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import final

import jax
import jax.numpy as jnp
from jax import lax

from ..compiled import compiled
from ..effects.particle_shifting import shift_velocity, shifting_term
from ..full_model import refresh_list
from ..neighbors import NeighborSearch
from ..pairs import Space, pair_sum
from .base import Arrangement
from .jittered_lattice import JitteredLattice

_STEP = 0.15  # times dx: the way of the fastest particle in a step
_SKIN = 0.82  # times dx


@final
@dataclass(frozen=True)
class Stirred(Arrangement):
    """A jittered lattice stirred by vortices of the box and kept even by particle shifting.

    A lattice, or particles packed to rest on one, hold still at the stagnation points of a flow for
    a while and then break up, which is heard as sound. Particles that have been stirred are
    disordered and even from the start, as they are later in any flow. They are carried by

        u = (sin X cos Y, -L_y / L_x cos X sin Y),    X = 2 pi x / L_x, Y = 2 pi y / L_y

    (in 3D times cos Z, with no third component), and by the shift velocity of `ParticleShifting`
    for a speed of 1.

    Args:
        seed: of the jitter.
        way: of the fastest particle, in lengths of the box.
    """

    seed: int = 0
    way: float = 0.4

    def positions(self, space):
        """As `Arrangement.positions`.

        Raises:
            ValueError: if the box is closed in a direction, or particles clump.
        """
        return _stirred(self, space, jnp.zeros(()).dtype)


def swirl(position, space: Space):
    """The stirring velocity at positions; solenoidal, of unit amplitude along x."""
    wave = [
        2.0 * math.pi * (position[:, k] - lower) / length
        for k, (lower, length) in enumerate(zip(space.box.lower, space.box.lengths, strict=True))
    ]
    u = jnp.sin(wave[0]) * jnp.cos(wave[1])
    v = -jnp.cos(wave[0]) * jnp.sin(wave[1]) * (space.box.lengths[1] / space.box.lengths[0])
    if space.box.dim == 2:
        return jnp.stack([u, v], axis=1)
    damped = jnp.cos(wave[2])
    return jnp.stack([u * damped, v * damped, jnp.zeros_like(u)], axis=1)


@lru_cache(maxsize=8)
def _stirred(arrangement: Stirred, space: Space, dtype):
    if not all(space.box.periodic):
        raise ValueError(
            "arrangement: stirring needs a box that is periodic all round; between walls start on "
            "a lattice or a jittered lattice."
        )
    start = JitteredLattice(seed=arrangement.seed).positions(space)
    dx, dim = space.spacing, space.box.dim
    search = NeighborSearch.allocate(start, space.box, space.support, _SKIN * dx, margin=1.3)
    volume = jnp.full(start.shape[0], dx**dim, start.dtype)
    time_step = _STEP * dx
    steps = math.ceil(arrangement.way * max(space.box.lengths) / time_step)
    term = shifting_term(space)

    def step(carry, _):
        position, neighbors, overflow = carry
        neighbors = refresh_list(search, neighbors, position, 1.5 * time_step)
        fields = {"position": neighbors.sort(position), "volume": volume}
        sums = neighbors.unsort(pair_sum((term,), fields, space, neighbors)[term.name])
        position = position + time_step * shift_velocity(sums, space, jnp.ones((), dtype))
        middle = position + 0.5 * time_step * swirl(position, space)
        position = space.box.wrap(position + time_step * swirl(middle, space))
        return (position, neighbors, overflow | neighbors.overflow), None

    @compiled
    def run(position):
        carry = (position, search.build(position), jnp.zeros((), bool))
        return lax.scan(step, carry, None, length=steps)[0]

    position, _, overflow = jax.block_until_ready(run(start))
    if bool(overflow):
        raise ValueError("stirring: particles clumped; the box is too small for the spacing.")
    return position
