"""Whether particles' labels still are a space."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from jaxsph import Space, Trajectory
from jaxsph.cloud import Cloud

_NEAR = 1.5  # times dx: the eight around a particle on a square lattice
MIXED = 0.02  # of all pairs


def parted_share(trajectory: Trajectory, space: Space) -> Float[np.ndarray, " times"]:
    """The share of pairs that started within 1.5 dx and are out of the kernel's reach,

        p(t) = |{(i, j): |x_i(0) - x_j(0)| < 1.5 dx, |x_i(t) - x_j(t)| > 2 h}| / |{(i, j): ...}|,

    2 h the support's radius. Fields are smooth over labels as long as neighbours stay neighbours;
    where water splashes, turns over or shears without end they part, and modes of labels mean
    nothing.

    Args:
        trajectory: of a full or a reduced run.
        space: of its scene.
    """
    box = space.box
    start, lengths = trajectory.position[0], np.asarray(box.lengths)
    periodic = np.asarray(box.periodic)
    first, second = Cloud(start, box).pairs(_NEAR * space.spacing).T
    apart = trajectory.position[:, second] - trajectory.position[:, first]
    apart -= np.where(periodic, lengths * np.round(apart / lengths), 0.0)
    return (np.sum(apart**2, axis=2) > space.support**2).mean(axis=1)


def mixed_from(trajectory: Trajectory, space: Space) -> float | None:
    """The time [s] from which on more than 2 % of neighbours have parted (`parted_share`); None if
    labels stay a space to the end."""
    mixed = parted_share(trajectory, space) > MIXED
    return float(trajectory.time[int(np.argmax(mixed))]) if mixed.any() else None
