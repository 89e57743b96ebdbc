"""Parts of space, by their signed distance."""

from __future__ import annotations

import abc
from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce
from typing import final

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float


@dataclass(frozen=True)
class Region(abc.ABC):
    """A part of space. `a | b` is what is in either, `a & b` what is in both, `~a` the rest.

    A region is structure, not data: it is hashable by value.
    """

    @abc.abstractmethod
    def signed_distance(self, position: Float[Array, "points dim"]) -> Float[Array, " points"]:
        """Distance [m] to the region's surface, negative inside. Inside unions and outside
        intersections it may be less than the true distance in size; its sign is always right."""

    @property
    def flat_faces(self) -> tuple[tuple[int, float], ...]:
        """Axis and place [m] of its faces across the axes."""
        return ()

    def __or__(self, other: Region) -> Region:
        return Union((self, other))

    def __and__(self, other: Region) -> Region:
        return ~(~self | ~other)

    def __invert__(self) -> Region:
        return Complement(self)


@final
@dataclass(frozen=True)
class BoxRegion(Region):
    """A box with corners `lower` and `upper` [m]; infinite in a direction whose corners are."""

    lower: tuple[float, ...]
    upper: tuple[float, ...]

    def __post_init__(self):
        for name in ("lower", "upper"):  # not numpy's floats, whose dtype would spread
            object.__setattr__(self, name, tuple(map(float, getattr(self, name))))
        if len(self.lower) != len(self.upper) or not all(
            a < b for a, b in zip(self.lower, self.upper, strict=True)
        ):
            raise ValueError(f"BoxRegion: every upper must exceed its lower, got {self}.")

    @property
    def flat_faces(self):
        faces = [face for corner in (self.lower, self.upper) for face in enumerate(corner)]
        return tuple(face for face in faces if np.isfinite(face[1]))

    def signed_distance(self, position):
        beyond = []
        for k, (low, high) in enumerate(zip(self.lower, self.upper, strict=True)):
            x = position[:, k]
            if np.isfinite(low):
                beyond.append(low - x)
            if np.isfinite(high):
                beyond.append(x - high)
        if not beyond:
            return jnp.full(position.shape[0], -jnp.inf, position.dtype)
        inside = reduce(jnp.maximum, beyond)
        # of the two faces of a direction at most one is behind a point outside
        squared = sum(jnp.maximum(b, 0.0) ** 2 for b in beyond)
        outside = squared > 0.0
        return jnp.where(outside, jnp.sqrt(jnp.where(outside, squared, 1.0)), inside)


@final
@dataclass(frozen=True)
class BallRegion(Region):
    """A disc or ball of a centre and a radius [m]."""

    center: tuple[float, ...]
    radius: float

    def __post_init__(self):
        object.__setattr__(self, "center", tuple(map(float, self.center)))
        object.__setattr__(self, "radius", float(self.radius))
        if not self.radius > 0.0:
            raise ValueError(f"BallRegion: radius must be positive, got {self.radius:g} m.")

    def signed_distance(self, position):
        offset = position - jnp.asarray(self.center, position.dtype)[None, :]
        squared = jnp.sum(offset * offset, axis=1)
        apart = squared > 0.0  # the centre has no slope
        return jnp.where(apart, jnp.sqrt(jnp.where(apart, squared, 1.0)), 0.0) - self.radius


@final
@dataclass(frozen=True)
class SignedDistance(Region):
    """A region given by a function: positions (P, n) [m] -> signed distances (P,) [m].

    The function is written with `jax.numpy`; its gradient gives the walls' normals.
    """

    function: Callable[[Array], Array]

    def signed_distance(self, position):
        return self.function(position).astype(position.dtype)


@final
@dataclass(frozen=True)
class Union(Region):
    """What is in any of the parts."""

    parts: tuple[Region, ...]

    @property
    def flat_faces(self):
        return tuple(face for part in self.parts for face in part.flat_faces)

    def signed_distance(self, position):
        return reduce(jnp.minimum, [part.signed_distance(position) for part in self.parts])


@final
@dataclass(frozen=True)
class Complement(Region):
    """What is not in a region."""

    region: Region

    @property
    def flat_faces(self):
        return self.region.flat_faces

    def signed_distance(self, position):
        return -self.region.signed_distance(position)
