"""What is done or not: a branch for one run, a choice for each member of a batch."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jax import lax
from jax.custom_batching import custom_vmap
from jaxtyping import Array, Bool


def moved_if(going: Bool[Array, ""], move: Callable[[Any], Any], carry: Any) -> Any:
    """`move(carry)` where a run is going, else its carry.

    Alone it is `lax.cond`, and what does not go on costs nothing. `jax.vmap` of that would give
    each member a copy of all that `move` reads, of a tensor model its tensors; so members of a
    batch all move, and of each what it shall have is chosen.

    Args:
        going: whether.
        move: pure; makes a carry of a carry.
        carry: a pytree.
    """

    return _branch(_alone(going), going, move, carry)


def renewed_if(outdated: Bool[Array, ""], renew: Callable[[Any], Any], kept: Any) -> Any:
    """`renew(kept)` where that is outdated, else what is kept.

    Alone it is `lax.cond`. A batch under `jax.vmap` takes the branch where any of its members is
    outdated, all in step; those that are not keep what they have.

    Args:
        outdated: whether.
        renew: pure; makes anew what it is given.
        kept: a pytree.
    """
    return _branch(_any(outdated), outdated, renew, kept)


def _branch(taken, wanted, change: Callable[[Any], Any], carry: Any) -> Any:
    def chosen(carry):
        take = _among_many(wanted)
        return jax.tree.map(lambda new, old: lax.select(take, new, old), change(carry), carry)

    return lax.cond(taken, chosen, lambda carry: carry, carry)


@custom_vmap
def _any(wanted):
    """Of one run whether it is wanted; of a batch whether it is by any."""
    return wanted


@_any.def_vmap
def _(size, batched, wanted):
    return _any(jnp.any(wanted)), False


@custom_vmap
def _alone(going):
    """Of one run whether it goes on; true in a batch."""
    return going


@_alone.def_vmap
def _(size, batched, going):
    return jnp.ones((), bool), False


@custom_vmap
def _among_many(going):
    """True of one run, which has been asked; of a batch which members go on."""
    return jnp.ones((), bool)


@_among_many.def_vmap
def _(size, batched, going):
    return going, True
