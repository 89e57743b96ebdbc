"""Derivatives of functions of pairs, which are functions of pairs again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import jax


@dataclass(frozen=True)
class Linearised:
    """Columns T and tangents of the `active` ones -> tangent of `function`."""

    function: Callable
    active: tuple[int, ...]
    count: int  # columns of `function`

    def __call__(self, here, there):
        def at(here_active, there_active):
            return self.function(
                replaced(here[: self.count], self.active, here_active),
                replaced(there[: self.count], self.active, there_active),
            )

        primals = tuple([side[k] for k in self.active] for side in (here, there))
        tangents = tuple(list(side[self.count :]) for side in (here, there))
        return jax.jvp(at, primals, tangents)[1]


@dataclass(frozen=True)
class Transposed:
    """Columns T and cotangents of `function`'s sums -> cotangents of the `active` columns.

    T_i enters the sum of i as the first particle and the sums of its neighbours as the second.
    """

    function: Callable
    active: tuple[int, ...]
    count: int

    def __call__(self, here, there):
        mine, other = list(here[: self.count]), list(there[: self.count])
        active = [mine[k] for k in self.active]
        _, pull = jax.vjp(lambda a: self.function(replaced(mine, self.active, a), other), active)
        (as_first,) = pull(tuple(here[self.count :]))
        _, pull = jax.vjp(lambda a: self.function(other, replaced(mine, self.active, a)), active)
        (as_second,) = pull(tuple(there[self.count :]))
        return tuple(a + b for a, b in zip(as_first, as_second, strict=True))


def replaced(columns, places, values) -> list:
    """The columns with others at some places."""
    columns = list(columns)
    for k, value in zip(places, values, strict=True):
        columns[k] = value
    return columns
