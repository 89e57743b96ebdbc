"""What a pair term does with a ghost, where a scene has walls."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import TYPE_CHECKING, final

from .vector import Vector

if TYPE_CHECKING:
    from .pairs import PairTerm


class AtGhost(ABC):
    """What a pair term adds to the sum of a particle i for a ghost j."""

    @abstractmethod
    def reads(self, term: PairTerm) -> tuple[str, ...]:
        """Fields of the ghost that it needs beside position and volume."""

    @abstractmethod
    def function(self, term: PairTerm) -> Callable:
        """The function of the pair, i and j."""


@final
@dataclass(frozen=True)
class Same(AtGhost):
    """The ghost counts as a particle: the same function of its fields of the same names."""

    def reads(self, term):
        return term.reads

    def function(self, term):
        return term.function


@final
@dataclass(frozen=True)
class Mirrored(AtGhost):
    """The same function, but the ghost answers each particle with that one's own vector v_i, its
    part along the wall's normal n reversed: v_j = v_i - 2 ((v_i - v_w) . n) n.

    Args:
        field: name of v.
        wall: name of the ghosts' field v_w; zero if none is given.
    """

    field: str
    wall: str | None = None

    def reads(self, term):
        own = tuple(name for name in term.reads if name != self.field)
        return (*own, "normal") if self.wall is None else (*own, "normal", self.wall)

    def function(self, term):
        return _Mirroring(term.function, self.field, self.wall)


@final
@dataclass(frozen=True)
class Otherwise(AtGhost):
    """Another function, which reads fields of the ghost by names of its own.

    Args:
        names: of the ghost's fields.
        instead: the function; hashable by value, like that of a pair term.
    """

    names: tuple[str, ...]
    instead: Callable

    def reads(self, term):
        return self.names

    def function(self, term):
        return self.instead


def mirrored(vector: Vector, normal: Vector, wall: Vector | None = None) -> Vector:
    """v - 2 ((v - v_w) . n) n"""
    approach = vector if wall is None else vector - wall
    return _Image(vector, _Along(normal, approach.dot(normal) * -2.0))


class _Along(Vector):
    """s n: all its scalar products share those of n."""

    def __new__(cls, normal, size):
        made = super().__new__(cls, normal * size)
        made.normal, made.size = normal, size
        return made

    def dot(self, other):
        return self.normal.dot(other) * self.size


class _Image(Vector):
    """v and a jump: what is computed of v is not computed again, nor is the difference from it."""

    def __new__(cls, own, jump):
        made = super().__new__(cls, own + jump)
        made.own, made.jump = own, jump
        return made

    def dot(self, other):
        return self.own.dot(other) + self.jump.dot(other)

    def __sub__(self, other):
        return self.jump if other is self.own else super().__sub__(other)


@dataclass(frozen=True)
class _Mirroring:
    """`of(pair, i, j)` with j's `field` the mirror image of i's."""

    of: Callable
    field: str
    wall: str | None

    def __call__(self, pair, i, j):
        wall = None if self.wall is None else getattr(j, self.wall)
        image = mirrored(getattr(i, self.field), j.normal, wall)
        return self.of(pair, i, SimpleNamespace(**vars(j) | {self.field: image}))
