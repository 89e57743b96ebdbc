"""What ghosts get of the forces that they exert."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jaxtyping import Array

from .effects import Context
from .neighbors import WallPairs
from .pairs import Pair, PairTerm, Space
from .vector import Vector
from .wall_sums import ghost_sums
from .wall_surface import Loads, moment


def reaction_of_ghosts(
    terms: tuple[PairTerm, ...],
    rates: Callable[[dict[str, Array]], Array],
    fields: Mapping[str, Array],
    sums: Mapping[str, Array],
    ghosts: Mapping[str, Array],
    context: Context,
    pairs: WallPairs,
) -> Loads:
    """Force (G, n) [N] and torque about the origin [N m] on each ghost g, of all particles i:

        f_ig = -(dP/dS_i) . s_ig,    P = m sum_k du_k/dt,

    s_ig what the ghost adds to the sums S_i: minus what it adds to the rate of the fluid's
    momentum. A force along or across the line between the two passes from one to the other on that
    line (Irving and Kirkwood 1950), so through the wall where the line crosses it,

        x_ig = x_g + (x_i - x_g) d_g / ((x_i - x_g) . n_g),

    d_g the ghost's depth, and its torque is x_ig x f_ig: that of action and reaction where it acts
    along the line, that of the traction on the surface where it does not.

    Args:
        terms: of the second pass.
        rates: its sums -> rates of velocity (N, n) [m/s^2].
        fields, sums: of the particles, in the fluid list's sorted order.
        ghosts: their fields, their `depth` [m] among them, in the order of `pairs.ghosts`.
        context: mass and space are read.
        pairs: the list.
    """
    terms = tuple(term for term in dict.fromkeys(terms) if term.ghost is not None)
    dim = context.space.box.dim
    found, pull = jax.vjp(rates, dict(sums))
    axes = -context.mass * jnp.eye(dim, dtype=found.dtype)
    pulled = [pull(jnp.broadcast_to(axis[None], found.shape))[0] for axis in axes]
    columns = {
        _share(term): jnp.concatenate([_wide(each[term.name]) for each in pulled], axis=1)
        for term in terms
    }
    reads = [name for term in terms for name in (*term.reads, *term.ghost.reads(term))]
    reads = tuple(dict.fromkeys((*reads, *columns, "normal", "depth")))
    whole = PairTerm("reaction", reads, _Reaction(terms, context.space))
    found = ghost_sums((whole,), {**fields, **columns}, ghosts, context.space, pairs)["reaction"]
    force, torque = found[:, :dim], found[:, dim:]
    return Loads(force, torque[:, 0] if dim == 2 else torque)


def _share(term: PairTerm) -> str:
    return f"share of {term.name}"


def _wide(values: Array) -> Array:
    return values[:, None] if values.ndim == 1 else values


@dataclass(frozen=True)
class _Reaction:
    """f_ig and x_ig x f_ig, of ghost i and particle j."""

    terms: tuple[PairTerm, ...]
    space: Space

    def __call__(self, pair, i, j):
        turned, force = Pair(self.space, j, i), [0.0] * len(pair.separation)
        for term in self.terms:
            value = term.ghost.function(term)(turned, j, i)
            value = value if isinstance(value, Vector) else Vector((value,))
            share = getattr(j, _share(term))
            for axis in range(len(force)):
                own = Vector(share[axis * len(value) : (axis + 1) * len(value)])
                force[axis] = force[axis] + own.dot(value)
        across = pair.separation.dot(i.normal)
        met = across > i.depth
        way = jnp.where(met, i.depth / jnp.where(met, across, 1.0), 1.0)
        return Vector((*force, *moment(i.position + pair.separation * way, force)))
