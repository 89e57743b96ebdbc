"""Ghosts in rows along a curved wall, where a lattice would make stairs of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from contourpy import contour_generator
from jaxtyping import Array, Float

from ..pairs import Space
from .region import Region

_FINE = 4  # points a spacing, of the grid on which rows are traced
_STEEP = 0.01  # squared slope of a signed distance, at least
_ONTO = 2  # times that their ghosts are put onto them


def rows_along(
    distance: Callable[[Array], Array], slope: Callable[[Array], Array], space: Space, layers: int
) -> Float[np.ndarray, "ghosts dim"]:
    """Places [m] in rows half a spacing, one and a half, ... behind the walls, a spacing apart.

    A row is a level of the signed distance, `(k + 1/2) dx`, traced on a fine grid; its ghosts are
    as many as go into its length, evenly, those of every other closed row half a place on. So they
    have a lattice cell's area each, but for rounding to whole ghosts, and the wall's mass is the
    same all along its surface. Rows end at the box, and know nothing of ghosts on the lattice.

    Args:
        distance: positions (P, 2) [m] -> the signed distance of the region of fluid there [m].
        slope: of that.
        space: its spacing is theirs.
        layers: how many rows.

    Raises:
        ValueError: in other than two dimensions.
    """
    if space.box.dim != 2:
        raise ValueError(
            "in_rows: ghosts stand in rows along a wall in two dimensions; leave it out in three."
        )
    box, axes = space.box, []
    sides = zip(box.lower, box.upper, space.steps, box.periodic, strict=True)
    for lower, upper, step, periodic in sides:
        more = 0 if periodic else layers  # beyond closed faces, as the lattice of ghosts
        count = _FINE * (round((upper - lower) / step) + 2 * more)
        axes.append(np.linspace(lower - more * step, upper + more * step, count + 1))
    x, y = axes
    grid = np.stack(np.meshgrid(x, y), axis=-1)
    depth = distance(grid.reshape(-1, 2)).reshape(grid.shape[:2])
    traced = contour_generator(x, y, depth)
    found, apart = [np.zeros((0, 2))], space.cell_volume / space.spacing
    for k in range(layers):
        level = (k + 0.5) * space.spacing
        for line in traced.lines(level):
            places = _along(line, apart, 0.5 * (k % 2))
            for _ in range(_ONTO):
                off, uphill = distance(places) - level, slope(places)
                squared = np.maximum((uphill**2).sum(axis=1), _STEEP)
                places = places - (off / squared)[:, None] * uphill
            found.append(places)
    return np.concatenate(found)


def put_in_rows(
    ghosts: Float[np.ndarray, "ghosts dim"],
    rows: Float[np.ndarray, "others dim"],
    parts: Sequence[Region],
    held: Callable,
) -> Float[np.ndarray, "all dim"]:
    """Ghosts with those of some parts of the walls replaced by the rows there.

    Args:
        ghosts: on the lattice [m].
        rows: along all walls [m].
        parts: whose ghosts are replaced.
        held: parts, places -> for each of the parts, which of the places it holds.

    Raises:
        ValueError: for a part without a wall.
    """
    on_lattice, standing = (held(parts, places) for places in (ghosts, rows))
    for part, own in zip(parts, standing, strict=True):
        if not own.any():
            raise ValueError(f"in_rows: no fixed wall lies in {part}; name parts of these alone.")
    return np.concatenate([ghosts[~np.any(on_lattice, axis=0)], rows[np.any(standing, axis=0)]])


def _from_the_right(ring: np.ndarray) -> np.ndarray:
    """A closed line from where it is, farthest right, at the middle of its height, and back there:
    one that is its own mirror image in y then has places that are so, too."""
    middle = 0.5 * (ring[:, 1].min() + ring[:, 1].max())
    then = np.roll(ring, -1, axis=0)
    crosses = (ring[:, 1] >= middle) != (then[:, 1] >= middle)
    rise = np.where(crosses, then[:, 1] - ring[:, 1], 1.0)
    x = ring[:, 0] + (middle - ring[:, 1]) / rise * (then[:, 0] - ring[:, 0])
    k = int(np.argmax(np.where(crosses, x, -np.inf)))
    start = [[x[k], middle]]
    return np.concatenate([start, ring[k + 1 :], ring[: k + 1], start])


def _along(line: np.ndarray, apart: float, first: float) -> np.ndarray:
    """Places along a line, as many as go into it so far apart; from half a place on if it is open,
    else from the first."""
    if np.array_equal(line[0], line[-1]):
        line = _from_the_right(line[:-1])
    else:
        first = 0.5
    way = np.concatenate([[0.0], np.linalg.norm(np.diff(line, axis=0), axis=1).cumsum()])
    count = round(way[-1] / apart)
    at = (np.arange(count) + first) * (way[-1] / max(1, count))
    return np.stack([np.interp(at, way, part) for part in line.T], axis=1)
