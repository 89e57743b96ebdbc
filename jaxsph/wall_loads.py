"""What the fluid does to each ghost, and the shares of the walls' parts in what is no pair's."""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp
from jaxtyping import Array, Float

from .at_ghosts import Otherwise
from .effects import Effect
from .effects.local_no_slip import NearWeight
from .neighbors import WallList
from .pairs import PairTerm
from .wall_reaction import reaction_of_ghosts
from .wall_sums import wall_sums
from .wall_surface import Loads
from .walls import Walls


def ghost_loads(
    effects: tuple[Effect, ...],
    walls: Walls,
    passed: tuple,
    neighbors: WallList,
    held: Float[Array, "parts ghosts"],
) -> tuple[Loads, Float[Array, "parts particles"]]:
    """What all sums do to each ghost, in the order of the list's pairs, and the share that each
    part has in the walls near each particle.

    Args:
        effects: of the scene.
        walls: where they are then.
        passed: what `SPHFunctional.passes` found.
        neighbors: the list by which it did.
        held: 1 for the ghosts of each part, 0 for others, in the order of the list's pairs; the
            first part has them all.
    """
    context, fields, ghosts, terms, sums = passed

    def rates(sums):
        parts = (effect.rates(context, fields, sums) for effect in effects)
        return sum(part["velocity"] for part in parts if "velocity" in part)

    pairs = neighbors.wall
    depth = walls.signed_distance(ghosts["position"])
    if walls.free is not None:  # a turn's round-off must not put one before its surface
        own = walls.free.owner[pairs.ghosts] < len(walls.free.parts)
        depth = jnp.where(own, walls.free.depth[pairs.ghosts], depth)
    ghosts = ghosts | {"depth": depth, "held": held.T}
    on_ghosts = reaction_of_ghosts(terms, rates, fields, sums, ghosts, context, pairs)
    near = PairTerm("wall_nearness", (), None, Otherwise(("held",), _nearness(context.space)))
    nearness = wall_sums((near,), fields, ghosts, context.space, pairs)["wall_nearness"].T
    whole = nearness[:1]
    shares = nearness / jnp.where(whole > 0.0, whole, 1.0)
    return on_ghosts, shares


@dataclass(frozen=True)
class _Nearness(NearWeight):
    """The same for the ghosts of each part by themselves."""

    def __call__(self, pair, i, j):
        return j.held * self.weight(pair)


def _nearness(space) -> _Nearness:
    return _Nearness(1.0 / space.kernel_at_spacing)
