"""Vectors whose components are whole arrays, so that pair functions read like their equations."""

from __future__ import annotations

from jaxtyping import Array


class Vector(tuple):
    """A tuple of n component arrays with the arithmetic of a vector.

    Components stay apart because XLA keeps a fused loop over pairs only as long as nothing is
    stacked inside it.
    """

    def __add__(self, other: Vector) -> Vector:
        return Vector(a + b for a, b in zip(self, other, strict=True))

    def __sub__(self, other: Vector) -> Vector:
        return Vector(a - b for a, b in zip(self, other, strict=True))

    def __mul__(self, factor: Array | float) -> Vector:
        return Vector(a * factor for a in self)

    __rmul__ = __mul__

    def dot(self, other: Vector) -> Array:
        """The scalar product."""
        return sum((a * b for a, b in zip(self[1:], other[1:], strict=True)), self[0] * other[0])
