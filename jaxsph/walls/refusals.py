"""Walls that are refused: with gaps, torn at a periodic face, or too thin."""

from __future__ import annotations

import math
from itertools import pairwise, product

import jax.numpy as jnp
import numpy as np

from ..pairs import Space
from .region import Region

_PITCH = 0.25  # times dx: at which the box's faces are searched for gaps
_SEAM = 0.25  # times dx: so far beyond a seam
_TOUCH = 1e-6  # times dx: round-off of a surface that lies in a face of the box


def place(point) -> str:
    """A point, as errors tell of it."""
    return "(" + ", ".join(f"{x:.4g}" for x in point) + ") m"


def refuse_gaps(distance, space: Space, opening: Region | None = None) -> None:
    """The fluid must not reach past a closed face of the box, but where there is an opening."""
    box = space.box
    for axis, side in product(range(box.dim), (0, 1)):
        if box.periodic[axis]:
            continue
        face = _face(space, axis, (box.lower, box.upper)[side][axis])
        depth = distance(face)
        if opening is not None:
            depth = np.where(opening.signed_distance(jnp.asarray(face)) < space.spacing, 0.0, depth)
        if depth.min() < -_TOUCH * space.spacing:
            raise ValueError(
                f"walls: a gap at {place(face[int(np.argmin(depth))])}: the fluid reaches past a "
                "closed face of its box there. Close it with a wall, widen the box, or make that "
                "direction periodic."
            )


def refuse_seams(distance, space: Space, cells, outward) -> None:
    """Regions joined without an overlap leave a wall of no thickness between them.

    Args:
        distance: signed, of places (P, n) [m].
        space: gives the spacing.
        cells: places in the fluid, within a spacing of a wall [m].
        outward: the distance's gradients there.
    """
    surface = cells - distance(cells)[:, None] * outward
    beyond = surface + _SEAM * space.spacing * outward
    seam = (np.abs(distance(surface)) < _TOUCH * space.spacing) & (
        distance(beyond) < -0.9 * _SEAM * space.spacing
    )
    if seam.any():
        raise ValueError(
            f"walls: a wall of no thickness at {place(surface[int(np.argmax(seam))])}, where two "
            "regions of fluid touch; let them overlap where they are joined."
        )


def refuse_torn_walls(distance, space: Space) -> None:
    """What is wall on one periodic face of the box must be wall on the other: it is one place."""
    box, least = space.box, _TOUCH * space.spacing
    for axis in range(box.dim):
        if not box.periodic[axis]:
            continue
        faces = [_face(space, axis, end[axis]) for end in (box.lower, box.upper)]
        low, high = (distance(face) for face in faces)
        torn = ((low > least) & (high < -least)) | ((low < -least) & (high > least))
        if torn.any():
            here, there = (face[int(np.argmax(torn))] for face in faces)
            raise ValueError(
                f"walls: torn at a periodic face of the box: {place(here)} and {place(there)} are "
                "one place, a wall by the one and fluid by the other. Move the body off the face, "
                "or join it with its copy a box's length further: body | copy."
            )


def _face(space: Space, axis: int, at: float) -> np.ndarray:
    """Points of a face of the box, a fraction of a spacing apart."""
    box, ticks = space.box, []
    for k, (low, length) in enumerate(zip(box.lower, box.lengths, strict=True)):
        count = 1 if k == axis else max(2, round(length / (_PITCH * space.spacing)) + 1)
        ticks.append(low + np.linspace(0.0, length, count))
    ticks[axis] = np.asarray([at])
    return np.stack(np.meshgrid(*ticks, indexing="ij"), axis=-1).reshape(-1, box.dim)


def refuse_thin_walls(distance, space: Space, surface, normal) -> None:
    """Fluid on one side of a wall must not be felt on the other, nor by the other's ghosts."""
    needed = 2.0 * space.support
    depths = np.arange(0.25, needed / space.spacing, 0.5) * space.spacing
    for before, depth in pairwise([0.0, *depths]):
        behind = np.asarray(space.box.wrap(jnp.asarray(surface - depth * normal)))
        wet = distance(behind) < 0.0
        if wet.any():
            thickness = max(before, 0.5 * depth)
            finer = math.ceil(10.0 * needed / thickness) / 10.0
            raise ValueError(
                f"walls: the wall at {place(surface[int(np.argmax(wet))])} is about "
                f"{thickness:.2g} m thick, thinner than twice the kernel's support of "
                f"{space.support:.3g} m; the fluids on its two sides would feel each other. Make "
                f"it {needed:.3g} m thick, or raise the resolution {finer:g} times."
            )
