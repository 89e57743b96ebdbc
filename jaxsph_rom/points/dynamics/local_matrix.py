"""The matrix of a local linear function of fields on points, found by probing."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.sparse
from jaxtyping import Float

from jaxsph import Box
from jaxsph.cloud import Cloud


def local_matrix(
    function: Callable[[Float[np.ndarray, "points components"]], Float[np.ndarray, " points"]],
    points: Float[np.ndarray, "points dim"],
    components: int,
    box: Box,
    reach: float,
) -> scipy.sparse.csr_array:
    """A with A v = function(v), v stacked point by point.

    Points whose effects cannot meet share a colour and are probed at once (Curtis, Powell and Reid
    1974): some hundred evaluations, whatever the number of points.

    Args:
        function: linear; its value at a point depends on points nearer than `reach` only.
        points: (G, n) [m].
        components: of a field at a point.
        box: in which points are; periodic directions are closed.
        reach: [m].
    """
    points, count = np.asarray(points, float), len(points)
    colour = _colours(Cloud(points, box).each_around(points, 2.0 * reach))
    rows, columns, values = [], [], []
    for group in (np.flatnonzero(colour == c) for c in range(colour.max() + 1)):
        apart, nearest = Cloud(points[group], box).nearest(points)
        row = np.flatnonzero(apart < reach)
        source = group[nearest[row]]
        for k in range(components):
            probe = np.zeros((count, components))
            probe[group, k] = 1.0
            rows.append(row)
            columns.append(source * components + k)
            values.append(np.asarray(function(probe))[row])
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return scipy.sparse.csr_array(entries, shape=(count, count * components))


def _colours(conflicts) -> np.ndarray:
    """A colour for each point, none like that of a point in its list."""
    colour = np.full(len(conflicts), -1)
    for point, others in enumerate(conflicts):
        taken = set(colour[others])
        colour[point] = next(c for c in range(len(conflicts)) if c not in taken)
    return colour
