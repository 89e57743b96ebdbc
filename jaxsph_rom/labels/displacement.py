"""Where particles have gone from, seen from their labels."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from jaxsph import Box, Trajectory


def displacement(
    trajectory: Trajectory, box: Box
) -> Float[np.ndarray, "times particles dim"]:
    """xi(t) = x(t) - x(0) [m], gone on with across periodic faces; no particle may go half the
    box's length from one snapshot to the next."""
    steps = np.diff(trajectory.position, axis=0, prepend=trajectory.position[:1])
    for axis, length in enumerate(box.lengths):
        if box.periodic[axis]:
            steps[:, :, axis] -= length * np.round(steps[:, :, axis] / length)
    return np.cumsum(steps, axis=0)


def label_snapshots(
    trajectory: Trajectory, box: Box
) -> tuple[Float[np.ndarray, "times numbers"], Float[np.ndarray, "times particles"]]:
    """Motion (xi, u), displacement and velocity in a row, and density, of every label."""
    times = len(trajectory.time)
    parts = (displacement(trajectory, box), trajectory.velocity)
    motion = np.concatenate([part.reshape(times, -1) for part in parts], axis=1)
    return motion, np.asarray(trajectory.density)
