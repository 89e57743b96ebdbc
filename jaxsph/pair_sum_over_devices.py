"""Pair sums by rows, each device those of its own."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import jax.numpy as jnp
from jax.extend.core import Primitive
from jax.interpreters import mlir
from jaxtyping import Array

from .exchange import Exchange


def lowered(pair_sum: Primitive, alone: Callable) -> Callable:
    """How the primitive is lowered, `alone` being how it is on one device."""

    def lower(context, *arguments, exchange, **parameters):
        if exchange is None:
            return alone(context, *arguments, **parameters)
        shared = partial(sums_over_devices, pair_sum.bind, exchange=exchange)
        return mlir.lower_fun(shared)(context, *arguments, **parameters)

    return lower


def sums_over_devices(
    sums: Callable, index: Array, *columns: Array, rows, mapped, exchange: Exchange, **parameters
) -> list[Array]:
    """`sums(index, *columns, rows=..., mapped=...)` of each device's rows of the list.

    Entries of the list count in a device's window, its own rows first. So the columns that each
    reads are those of its window, and the sum is one as on a single device, of fewer rows than
    there are entries to read.

    Args:
        sums: the pair sum on one device.
        index: the list (R, C), or (K, R, C) of K members.
        columns: fields (R,), or (K, R).
        rows: first row wanted of each device's and the one past the last; all if none are given.
        mapped: places of the arguments that have members.
        exchange: of rows among the devices.
        parameters: of `sums`, the same for all.
    """

    def own(index, *columns):
        heights = [len(c) if k in mapped else 0 for k, c in enumerate(columns, 1)]
        table = jnp.concatenate([jnp.atleast_2d(c) for c in columns])  # one message for all
        table, start, read = exchange.window(table), 0, []
        for height in heights:
            read.append(table[start : start + height] if height else table[start])
            start += height or 1
        return tuple(sums(index, *read, rows=rows, mapped=mapped, exchange=None, **parameters))

    given = [1 if k in mapped else 0 for k in range(1 + len(columns))]
    return list(exchange.devices.each(own, given, 1 if mapped else 0)(index, *columns))


def without_others(
    cotangents: list[Array], rows: tuple[int, int], count: int, exchange: Exchange | None
) -> list[Array]:
    """Cotangents of the sums of some rows, with zeros for all others of `count`."""
    shares = 1 if exchange is None else exchange.devices.count
    beyond = (rows[0], count // shares - rows[1])
    if exchange is None:
        along = [(0, 0)] * (cotangents[0].ndim - 1) + [beyond]
        return [jnp.pad(c, along) for c in cotangents]
    along = [(0, 0)] * cotangents[0].ndim + [beyond]
    split = [c.reshape(*c.shape[:-1], shares, -1) for c in cotangents]
    return [jnp.pad(c, along).reshape(*c.shape[:-2], count) for c in split]
