"""Mapping over rows a chunk at a time: working sets stay in cache, both cores stay busy."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jax import lax

_SHARES = 8  # sizes are multiples of it, for cores to share evenly: XLA's loop of an odd size
# takes half as long again


def chunked_map(function, rows, chunk: int):
    """`function` over the leading axis of the arrays `rows`, about `chunk` rows at a time at most.

    `function` takes and returns arrays whose leading axis is the chunk's. Rows are padded with
    zeros to whole chunks of equal size and the padding's results are dropped.
    """
    total, count, size = _sizes(rows, chunk)

    def split(a):
        padding = [(0, count * size - total)] + [(0, 0)] * (a.ndim - 1)
        return jnp.pad(a, padding).reshape((count, size) + a.shape[1:])

    out = lax.map(function, jax.tree.map(split, rows))
    return jax.tree.map(lambda a: a.reshape((count * size,) + a.shape[2:])[:total], out)


def overlapping_map(function, rows, chunk: int):
    """The same without a padded copy of the rows: the last chunk begins where it still fits.

    Not for reverse mode, where every chunk would add to a cotangent of all rows.
    """
    total, count, size = _sizes(rows, chunk)
    size = min(size, total)
    starts = jnp.minimum(size * jnp.arange(count, dtype=jnp.int32), total - size)

    def one(start):
        return function(jax.tree.map(lambda a: lax.dynamic_slice_in_dim(a, start, size), rows))

    def joined(a):
        before = a[:-1].reshape((-1,) + a.shape[2:])
        return jnp.concatenate([before, a[-1, count * size - total :]])

    return jax.tree.map(joined, lax.map(one, starts))


def _sizes(rows, chunk: int) -> tuple[int, int, int]:
    """Rows, chunks, and rows of a chunk."""
    total = jax.tree.leaves(rows)[0].shape[0]
    count = max(1, -(-total // chunk))
    size = max(1, -(-total // (_SHARES * count))) * _SHARES
    return total, max(1, -(-total // size)), size
