"""Mapping over rows a chunk at a time: working sets stay in cache, both cores stay busy."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jax import lax

_SHARES = 8  # sizes are multiples of it, for cores to share evenly: XLA's loop of an odd size
# takes half as long again
_WIDER = 128  # times the rows: a list of a million particles in some five chunks


def chunked_map(function, rows, chunk: int):
    """`function` over the leading axis of the arrays `rows`, at most `chunk` rows at a time.

    `function` takes and returns arrays whose leading axis is the chunk's. The last row is repeated
    up to whole chunks of equal size, and what comes of that is dropped: such rows are as sound as
    the others, derivatives included.
    """
    total = jax.tree.leaves(rows)[0].shape[0]
    count = max(1, -(-total // chunk))
    size = -(-total // count)
    beyond = count * size - total

    def split(a):
        a = jnp.concatenate([a, jnp.repeat(a[-1:], beyond, axis=0)]) if beyond else a
        return a.reshape((count, size) + a.shape[1:])

    out = lax.map(function, jax.tree.map(split, rows))
    return jax.tree.map(lambda a: a.reshape((count * size,) + a.shape[2:])[:total], out)


def wide_map(function, rows, chunk: int):
    """The same in far larger chunks on a GPU, which has the memory and takes long to begin each.

    Not for reverse mode, where what either way keeps would be kept.
    """
    return lax.platform_dependent(
        rows,
        cpu=lambda rows: chunked_map(function, rows, chunk),
        default=lambda rows: chunked_map(function, rows, _WIDER * chunk),
    )


def overlapping_map(function, rows, chunk: int):
    """The same without a copy of the rows: the last chunk begins where it still fits.

    Not for reverse mode, where every chunk would add to a cotangent of all rows.
    """
    total = jax.tree.leaves(rows)[0].shape[0]
    count = max(1, -(-total // chunk))
    size = min(max(1, -(-total // (_SHARES * count))) * _SHARES, total)
    count = max(1, -(-total // max(1, size)))
    starts = jnp.minimum(size * jnp.arange(count, dtype=jnp.int32), total - size)

    def one(start):
        return function(jax.tree.map(lambda a: lax.dynamic_slice_in_dim(a, start, size), rows))

    def joined(a):
        before = a[:-1].reshape((-1,) + a.shape[2:])
        return jnp.concatenate([before, a[-1, count * size - total :]])

    return jax.tree.map(joined, lax.map(one, starts))
