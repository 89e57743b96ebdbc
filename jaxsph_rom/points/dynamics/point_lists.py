"""Neighbour lists of points that do not move, made on the host."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from jaxsph import SPHFunctional, VerletList, WallList
from jaxsph.cloud import Cloud
from jaxsph.neighbors import WallPairs, check_periodic


def neighbors_at(
    functional: SPHFunctional, points: Float[Array, "points dim"]
) -> VerletList | WallList:
    """The neighbours of fixed points within the kernel's support, ghosts of walls among them.

    As `NeighborSearch.build` and `WalledSearch.build`, in the order of the points: nothing is
    compiled for a list that is made once.

    Raises:
        ValueError: if the box is too small for the kernel's support.
    """
    space, walls = functional.space, functional.walls
    check_periodic(space.box, space.support)
    cloud = Cloud(np.asarray(points), space.box)
    one, other = _pairs(cloud, cloud.positions, space.support)
    apart = one != other
    count = np.arange(len(points), dtype=np.int32)
    fluid = VerletList(
        index=_rows(one[apart], other[apart], len(points)),
        order=jnp.asarray(count),
        inverse=jnp.asarray(count),
        reference=points,
        largest_count=jnp.zeros((), jnp.int32),
        cell_overflow=jnp.zeros((), jnp.int32),
    )
    if walls is None:
        return fluid
    ghosts = len(walls.position)
    ghost, point = _pairs(cloud, np.asarray(walls.position), space.support)
    near, row = np.unique(point, return_inverse=True)
    first = np.concatenate([row, len(near) + ghost])
    second = np.concatenate([len(near) + ghost, row])
    pairs = WallPairs(
        index=_rows(first, second, len(near) + ghosts),
        near=jnp.asarray(near, jnp.int32),
        ghosts=jnp.arange(ghosts, dtype=jnp.int32),
    )
    return WallList(fluid, pairs, jnp.zeros((), bool))


def _pairs(cloud: Cloud, places, radius) -> tuple[Int[np.ndarray, " pairs"], ...]:
    """Numbers of a place and of a point of the cloud within a radius of it, pair by pair."""
    found = cloud.each_around(places, radius)
    place = np.repeat(np.arange(len(places)), [len(points) for points in found])
    return place, np.fromiter((k for points in found for k in points), int, len(place))


def _rows(first, second, rows: int) -> Int[Array, "rows capacity"]:
    """For each row what it is paired with; free slots hold the row's own number."""
    order = np.lexsort((second, first))
    first, second = first[order], second[order]
    counts = np.bincount(first, minlength=rows)
    slot = np.arange(len(first)) - np.repeat(np.cumsum(counts) - counts, counts)
    index = np.repeat(np.arange(rows)[:, None], max(1, counts.max(initial=0)), axis=1)
    index[first, slot] = second
    return jnp.asarray(index, jnp.int32)
