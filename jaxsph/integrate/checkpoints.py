"""Scans that reverse mode goes back through without keeping every step."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
from jax import lax

_STATES = 2.0  # kept for each square root of a step; what a step leaves is some four states large


def segment_length(steps: int, intervals: int, checkpoints: int | None) -> int:
    """Steps between two states that reverse mode keeps.

    With C states kept of N steps, memory is C states and what N / C steps leave: it is least, and
    grows as the square root of N, where C is a few times that root. Between half and all of the
    states asked for are kept, so that the segments fill an interval as evenly as may be; each
    interval keeps its own start at least.

    Args:
        steps: of an interval.
        intervals: in the run.
        checkpoints: states to keep in the whole run; 2 N^1/2 if none is given.

    Raises:
        ValueError: if there are to be none.
    """
    if checkpoints is None:
        checkpoints = math.ceil(_STATES * math.sqrt(steps * intervals))
    if checkpoints < 1:
        raise ValueError(f"checkpoints: at least 1, got {checkpoints}.")
    least = math.ceil(steps / max(1, checkpoints // intervals))
    candidates = range(least, min(2 * least, steps) + 1)
    return min(candidates, key=lambda length: (-steps % length, length))


def checkpointed_scan(body: Callable, carry: Any, xs: Any, segment: int) -> Any:
    """The carry after `lax.scan(body, carry, xs)`, of which reverse mode keeps each `segment`-th.

    The steps of a segment run once more when reverse mode comes to it (Griewank and Walther 2000,
    one level). Forward mode and batching are those of `lax.scan`.

    Args:
        body: (carry, x) -> carry.
        carry: at the start.
        xs: arrays with a leading axis.
        segment: length of a segment.
    """
    length = len(jax.tree.leaves(xs)[0])
    count = -(-length // segment)
    unused = count * segment - length

    def step(carry, x):
        x, used = x
        if not unused:
            return body(carry, x), None
        return lax.cond(used, body, lambda carry, _: carry, carry, x), None

    def split(a):
        return jnp.pad(a, [(0, unused)] + [(0, 0)] * (a.ndim - 1)).reshape(
            -1, segment, *a.shape[1:]
        )

    @partial(jax.checkpoint, prevent_cse=False)  # within a scan there is nothing to merge it with
    def part(carry, xs):
        return lax.scan(step, carry, xs)[0]

    used = jnp.arange(length) >= 0
    carry, _ = lax.scan(lambda c, x: (part(c, x), None), carry, jax.tree.map(split, (xs, used)))
    return carry
