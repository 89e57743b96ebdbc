"""Sums over the pairs of a fluid particle and a ghost."""

from __future__ import annotations

from collections.abc import Mapping

import jax.numpy as jnp
from jaxtyping import Array

from .neighbors import WallPairs
from .pairs import PairTerm, Space, pair_sum


def ghost_sums(
    terms: tuple[PairTerm, ...],
    fields: Mapping[str, Array],
    ghosts: Mapping[str, Array],
    space: Space,
    pairs: WallPairs,
) -> dict[str, Array]:
    """Sums for each ghost over the fluid particles near it.

    Args:
        terms: the sums wanted; i is the ghost, j the particle.
        fields: of the particles (N, ...), in the fluid list's sorted order.
        ghosts: of the ghosts (G, ...), in the order of `pairs.ghosts`.
        space: kernel and box.
        pairs: the list.

    Returns:
        for each term's name an array (G,) or (G, k).
    """
    if not terms:
        return {}
    read = ("position", "volume", *(name for term in terms for name in term.reads))
    table = _table(read, fields, ghosts, pairs)
    return pair_sum(terms, table, space, pairs, pairs.ghost_rows)


def wall_sums(
    terms: tuple[PairTerm, ...],
    fields: Mapping[str, Array],
    ghosts: Mapping[str, Array],
    space: Space,
    pairs: WallPairs,
) -> dict[str, Array]:
    """Sums for each fluid particle over the ghosts near it, of the terms to which these add.

    Args:
        terms: the sums wanted; i is the particle, j the ghost.
        fields, ghosts, space, pairs: as those of `ghost_sums`.

    Returns:
        for each term's name an array (N,) or (N, k), zero away from walls.

    Raises:
        ValueError: if a term reads a field that no effect gives the ghosts.
    """
    terms = tuple(term for term in dict.fromkeys(terms) if term.ghost is not None)
    if not terms:
        return {}
    needed = [name for term in terms for name in term.ghost.reads(term)]
    missing = {"volume", *needed} - set(ghosts)
    if missing:
        raise ValueError(
            f"effects: the ghosts of a scene with walls need {', '.join(sorted(missing))}; list "
            "WallPressure, and one of NoSlip, FreeSlip and FixedWallVelocity."
        )
    read = ["position", "volume", *(name for term in terms for name in term.reads), *needed]
    table = _table(read, fields, ghosts, pairs)
    summed = tuple(
        PairTerm(t.name, tuple(dict.fromkeys(t.reads + t.ghost.reads(t))), t.ghost.function(t))
        for t in terms
    )
    near = pair_sum(summed, table, space, pairs, pairs.fluid_rows)
    count = fields["volume"].shape[0]

    return {name: pairs.spread(values, count) for name, values in near.items()}


def _table(names, fields, ghosts, pairs: WallPairs) -> dict[str, Array]:
    """Fields of the rows of `pairs`; zero where only the other kind of particle has the field."""
    table = {}
    for name in dict.fromkeys(n for n in names if n in fields or n in ghosts):
        fluid, ghost = fields.get(name), ghosts.get(name)
        if fluid is not None:
            fluid = pairs.of_near(fluid)
        parts = [(fluid, pairs.near.shape[0]), (ghost, pairs.ghosts.shape[0])]
        like = ghost if fluid is None else fluid
        table[name] = pairs.table(
            *(jnp.zeros((k, *like.shape[1:]), like.dtype) if a is None else a for a, k in parts)
        )
    return table
