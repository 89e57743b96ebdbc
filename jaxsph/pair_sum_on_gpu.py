"""Pair sums on a GPU: one kernel for all sums of a pass, however many particles and members."""

from __future__ import annotations

import warnings

import jax
import jax.numpy as jnp
from jax import lax
from jax.interpreters import mlir

from .pair_rounding import without_rounding

_ROWS, _SLOTS = 16, 8  # of a tile of the list. A row's eight slots are 32 bytes, the least that a
# GPU reads at a time, so that nothing is read in vain and the list need not be transposed.
_WARPS = 4  # of 32 threads: one for each pair of a tile
_UNROLLED = 8  # slots of a turn of the ordinary loop


def tiled_sums(index, *columns, function, rows, mapped, interpret=False):
    """A kernel in Triton: a block takes a few rows and goes through their slots, a tile at a time.

    A thread holds one pair and its part of each sum, so nothing of the size of all pairs is kept.
    A block ends at the last slot that one of its rows uses. Members are further blocks: each reads
    its own columns and list, or those that all share.
    """
    from jax.experimental import pallas as pl  # where a GPU is: it takes a while to import
    from jax.experimental.pallas import triton

    first, last = rows or (0, index.shape[-2])
    count, capacity, number = last - first, index.shape[-1], len(columns)
    members = next(((index, *columns)[k].shape[0] for k in mapped), 1)
    index, *columns = (
        a if k in mapped else a[None] for k, a in enumerate((index, *columns))
    )
    own = jnp.arange(first, last, dtype=index.dtype)[None, :, None]
    slot = jnp.arange(1, capacity + 1, dtype=jnp.int32)[None, None, :]
    used = jnp.max(jnp.where(index[:, first:last] != own, slot, 0), axis=2)
    types = _types(function, columns)
    values = without_rounding(function)
    blocks = -(-count // _ROWS)

    def kernel(used, index, *refs):
        def load(k, ref, *at, **masked):
            return triton.load(ref.at[(member if k in mapped else 0, *at)], **masked)

        def whole(of_rows):
            return jnp.broadcast_to(of_rows[:, None], (_ROWS, _SLOTS))

        block = pl.program_id(0)
        member, block = block // blocks, block % blocks
        place = block * _ROWS + jnp.arange(_ROWS, dtype=jnp.int32)
        row = jnp.minimum(place, count - 1)
        here = first + row
        own = whole(here)
        i = [whole(load(k, a, here)) for k, a in enumerate(refs[:number], 1)]

        def add(turn, sums):
            slots = turn * _SLOTS + jnp.arange(_SLOTS, dtype=jnp.int32)[None, :]
            slots = jnp.broadcast_to(slots, (_ROWS, _SLOTS))
            near = load(0, index, own, slots, mask=slots < capacity, other=own)
            j = [load(k, a, near) for k, a in enumerate(refs[:number], 1)]
            return tuple(s + v for s, v in zip(sums, values(i, j), strict=True))

        turns = (jnp.max(load(0, used, row)) + (_SLOTS - 1)) // _SLOTS
        zeros = tuple(jnp.zeros((_ROWS, _SLOTS), t) for t in types)
        for ref, s in zip(refs[number:], lax.fori_loop(0, turns, add, zeros), strict=True):
            triton.store(ref.at[member, place], jnp.sum(s, axis=1))

    sums = pl.pallas_call(
        kernel,
        grid=(members * blocks,),
        out_shape=[jax.ShapeDtypeStruct((members, blocks * _ROWS), t) for t in types],
        compiler_params=triton.CompilerParams(num_warps=_WARPS, num_stages=1),
        interpret=interpret,
        name="pair_sum",
    )(used, index, *columns)
    return [s[:, :count] if mapped else s[0, :count] for s in sums]


def looped_sums(index, *columns, function, rows, mapped):
    """The same as an ordinary loop over slots, eight a turn, of all rows and members at once."""
    axes = [0 if k in mapped else None for k in range(1 + len(columns))]

    def of_member(index, *columns):
        first, last = rows or (0, len(index))
        own = jnp.arange(first, last, dtype=index.dtype)
        here = [column[first:last] for column in columns]
        beyond = jnp.broadcast_to(own, (-index.shape[1] % _UNROLLED, len(own)))
        turns = jnp.concatenate([index[first:last].T, beyond]).reshape(-1, _UNROLLED, len(own))

        def add(sums, turn):
            for near in turn:
                there = [c.at[near].get(mode="promise_in_bounds") for c in columns]
                sums = tuple(s + v for s, v in zip(sums, function(here, there), strict=True))
            return sums, None

        zeros = tuple(jnp.zeros(own.shape, t) for t in _types(function, columns))
        return lax.scan(add, zeros, turns)[0]

    of_all = jax.vmap(of_member, axes) if mapped else of_member
    return list(of_all(index, *columns))


def lower(context, *arguments, **parameters):
    """The kernel; where Triton lacks what a term needs, the loop, with a warning."""
    try:
        return mlir.lower_fun(tiled_sums)(context, *arguments, **parameters)
    except Exception as lack:  # of a kind that depends on JAX; a term's own errors come again below
        reason = str(lack).partition("\n")[0]
        warnings.warn(
            f"pair_sum: Triton cannot compile a term, so a slower loop is taken: {reason}",
            stacklevel=2,
        )
        return mlir.lower_fun(looped_sums)(context, *arguments, **parameters)


def _types(function, columns):
    """Of each sum."""
    tile = [jax.ShapeDtypeStruct((1, 1), c.dtype) for c in columns]
    return [o.dtype for o in jax.eval_shape(function, tile, tile)]
