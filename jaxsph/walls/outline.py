"""Regions of the plane within closed polygons."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, final

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .region import Region

_SEGMENTS_AT_A_TIME = 256  # segments compared with each other


@final
@dataclass(frozen=True)
class Outline(Region):
    """What lies within closed polygons, a polygon inside another being a hole; in two dimensions.

    The signed distance is exact: the least one to any segment, negative where a ray crosses the
    polygons an odd number of times. It costs an operation per point and segment; an outline that is
    finer than a fifth of the particles' spacing is better simplified first.

    Args:
        rings: for each polygon its corners [m] in order, either way round; the first need not be
            repeated at the end.

    Raises:
        ValueError: for fewer than three corners, ones that are not finite, or segments that cross.

    Examples:
        >>> import numpy as np
        >>> from jaxsph import Outline
        >>> triangle = Outline([[(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]])
        >>> inside = triangle.signed_distance(np.array([[0.25, 0.25], [2.0, 0.0]]))
        >>> [round(float(d), 3) for d in inside]
        [-0.25, 1.0]
    """

    rings: tuple[tuple[tuple[float, float], ...], ...]

    def __post_init__(self):
        object.__setattr__(self, "rings", tuple(_cleaned(ring) for ring in self.rings))
        if not self.rings:
            raise ValueError("Outline: got no polygon; give at least one.")
        _refuse_crossings(*self._segments())

    @classmethod
    def of_shapely(cls, shape: Any) -> Outline:
        """The outline of a polygon, or several, of the shapely library [m]."""
        parts = getattr(shape, "geoms", (shape,))
        rings = [ring for part in parts for ring in (part.exterior, *part.interiors)]
        return cls([np.asarray(ring.coords)[:, :2] for ring in rings])

    @property
    def size(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Lower and upper corner [m] of the box that it fills."""
        corners = np.concatenate([np.asarray(ring) for ring in self.rings])
        return tuple(corners.min(axis=0).tolist()), tuple(corners.max(axis=0).tolist())

    def signed_distance(self, position):
        if position.shape[1] != 2:
            raise ValueError(f"Outline: is of the plane, got points in {position.shape[1]} axes.")
        starts, ends = (jnp.asarray(a, position.dtype) for a in self._segments())
        along = ends - starts
        x, y = position[:, :1], position[:, 1:]
        (ax, ay), (dx, dy) = starts.T[:, None, :], along.T[:, None, :]
        share = ((x - ax) * dx + (y - ay) * dy) / jnp.sum(along * along, axis=1)[None, :]
        share = jnp.clip(share, 0.0, 1.0)
        apart = (x - ax - share * dx) ** 2 + (y - ay - share * dy) ** 2
        nearest = jnp.min(apart, axis=1)
        off = nearest > 0.0  # the outline itself has no slope
        distance = jnp.where(off, jnp.sqrt(jnp.where(off, nearest, 1.0)), 0.0)
        above, below = ay > y, ends[None, :, 1] > y
        rises = jnp.where(dy == 0.0, 1.0, dy)
        left_of_it = x < ax + (y - ay) * dx / rises
        crossings = jnp.sum((above != below) & left_of_it, axis=1)
        return jnp.where(crossings % 2 == 1, -distance, distance)

    def _segments(self) -> tuple[Float[np.ndarray, "segments 2"], Float[np.ndarray, "segments 2"]]:
        rings = [np.asarray(ring) for ring in self.rings]
        return np.concatenate(rings), np.concatenate([np.roll(ring, -1, axis=0) for ring in rings])


def _cleaned(ring: Iterable) -> tuple[tuple[float, float], ...]:
    """Corners as numbers of Python, none of them twice in a row."""
    points = np.asarray(ring, float)
    if points.ndim != 2 or points.shape[1] != 2 or not np.isfinite(points).all():
        raise ValueError(
            f"Outline: corners must be finite pairs (x, y) in metres, got shape {points.shape}."
        )
    size = float(np.ptp(points, axis=0).max()) if len(points) else 0.0
    apart = np.abs(points - np.roll(points, -1, axis=0)).max(axis=1) > 1e-12 * size
    points = points[apart]
    if len(points) < 3:
        raise ValueError(f"Outline: a polygon has at least three corners, got {len(points)}.")
    return tuple((float(x), float(y)) for x, y in points)


def _refuse_crossings(starts: np.ndarray, ends: np.ndarray) -> None:
    """A ValueError if two segments cross, each with its ends on both sides of the other."""

    def side(a, b, p):
        return (b[:, None, 0] - a[:, None, 0]) * (p[None, :, 1] - a[:, None, 1]) - (
            b[:, None, 1] - a[:, None, 1]
        ) * (p[None, :, 0] - a[:, None, 0])

    for first in range(0, len(starts), _SEGMENTS_AT_A_TIME):
        a, b = (points[first : first + _SEGMENTS_AT_A_TIME] for points in (starts, ends))
        apart = side(a, b, starts) * side(a, b, ends) < 0.0
        across = side(starts, ends, a) * side(starts, ends, b) < 0.0
        found = np.argwhere(apart & across.T)
        if len(found):
            x, y = 0.5 * (a[found[0][0]] + b[found[0][0]])
            raise ValueError(
                f"Outline: two of its segments cross near ({x:.4g}, {y:.4g}) m; what is inside is "
                "then not told. Mend the outline, by shapely's `buffer(0)` for instance."
            )
