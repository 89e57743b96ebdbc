"""Where a mean flow turns from back to forth along a line, as at the end of a wake."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float

from jaxsph import Trajectory
from jaxsph.interpolation import MovingLeastSquaresMap
from jaxsph.scenes import Scene


def mean_along(
    scene: Scene,
    trajectory: Trajectory,
    of: Bool[np.ndarray, " times"],
    points: Float[np.ndarray, "points dim"],
) -> Float[np.ndarray, " points"]:
    """The velocity along the first axis [m/s] at points [m], mean over some snapshots."""
    there = eqx.filter_jit(MovingLeastSquaresMap.allocate(jnp.asarray(points), scene.space))
    along = []
    for k in np.flatnonzero(of):
        values, overflow = there(
            jnp.asarray(trajectory.position[k]), jnp.asarray(trajectory.velocity[k][:, :1])
        )
        along.append(np.full(len(points), np.nan) if overflow else np.asarray(values)[:, 0])
    return np.mean(along, axis=0)


def last_turn(place: Float[np.ndarray, " points"], mean: Float[np.ndarray, " points"]) -> float:
    """Where the mean last goes from below zero to above [m]; NaN if it nowhere does.

    Examples:
        >>> import numpy as np
        >>> from benchmarks.where_flow_turns import last_turn
        >>> last_turn(np.array([0.0, 1.0, 2.0]), np.array([1.0, -1.0, 1.0]))
        1.5
    """
    turns = np.flatnonzero((mean[:-1] < 0.0) & (mean[1:] >= 0.0))
    if not len(turns):
        return float("nan")
    k = turns[-1]
    return float(place[k] + (place[k + 1] - place[k]) * mean[k] / (mean[k] - mean[k + 1]))
