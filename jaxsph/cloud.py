"""Which points are near which, on the host, in a box that may be periodic in some directions."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import cKDTree

from .domain import Box


class Cloud:
    """Points in a box, for questions of distance on the host; periodic images count.

    Args:
        positions: (G, n) [m].
        box: in which they are.

    Raises:
        ValueError: if a position is not finite.
    """

    def __init__(self, positions: Float[np.ndarray, "points dim"], box: Box):
        self.positions = np.asarray(positions, float)
        self._lower = np.asarray(box.lower)
        self._periodic, self._lengths = np.asarray(box.periodic), np.asarray(box.lengths)
        # the tree takes a length of 0 as a direction that is closed
        period = np.where(self._periodic, self._lengths, 0.0)
        self._tree = cKDTree(self._wrapped(self.positions), boxsize=period)

    def around(
        self, places: Float[np.ndarray, "places dim"], radius: float
    ) -> Int[np.ndarray, " found"]:
        """Numbers of the points within a radius of any of the places, in order."""
        if not len(places):
            return np.zeros(0, int)
        found = self.each_around(places, radius)
        return np.unique(np.concatenate([np.asarray(f, int) for f in found]))

    def each_around(self, places: Float[np.ndarray, "places dim"], radius: float) -> list[list]:
        """Numbers of the points within a radius of each place."""
        return self._tree.query_ball_point(self._wrapped(places), radius)

    def count_around(
        self, places: Float[np.ndarray, "places dim"], radius: float
    ) -> Int[np.ndarray, " places"]:
        """How many points are within a radius of each place."""
        return self._tree.query_ball_point(
            self._wrapped(places), radius, return_length=True, workers=-1
        )

    def pairs(self, radius: float) -> Int[np.ndarray, "pairs 2"]:
        """Numbers of each two points within a radius of one another, the smaller first."""
        return self._tree.query_pairs(radius, output_type="ndarray")

    def nearest(self, places: Float[np.ndarray, "places dim"]) -> tuple[np.ndarray, np.ndarray]:
        """Distance to and number of the point nearest to each place."""
        return self._tree.query(self._wrapped(places))

    def gaps(self) -> Float[np.ndarray, " points"]:
        """Each point's distance to the nearest other [m], infinite where there is none."""
        return self._tree.query(self._tree.data, 2)[0][:, 1]

    def _wrapped(self, positions):
        shifted = np.asarray(positions, float) - self._lower
        wrapped = np.mod(shifted, self._lengths)
        wrapped = np.where(wrapped >= self._lengths, 0.0, wrapped)  # mod may round up
        return np.where(self._periodic, wrapped, shifted)
