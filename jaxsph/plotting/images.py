"""Periodic images of particles, so that no rim of a picture stays white."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int
from matplotlib.axes import Axes

from ..domain import Box


def with_images(
    position: Float[np.ndarray, "particles 2"], box: Box | None, reach: float
) -> tuple[Float[np.ndarray, "drawn 2"], Int[np.ndarray, " drawn"]]:
    """The particles, behind them the images of those near a periodic face, and of which particle
    each is; of three dimensions the first two.

    Args:
        position: [m].
        box: none has no images.
        reach: how far images stand beyond a face [m].
    """
    index = np.arange(len(position))
    for axis in range(2):
        if box is None or not box.periodic[axis]:
            continue
        away = np.zeros(2, position.dtype)
        away[axis] = box.lengths[axis]
        low = position[:, axis] < box.lower[axis] + reach
        high = position[:, axis] > box.upper[axis] - reach
        index = np.concatenate([index, index[low], index[high]])
        position = np.concatenate([position, position[low] + away, position[high] - away])
    return position, index


def fit_box(axes: Axes, box: Box | None) -> None:
    """Limits at the periodic faces of the box."""
    for axis, limits in enumerate((axes.set_xlim, axes.set_ylim)):
        if box is not None and box.periodic[axis]:
            limits(box.lower[axis], box.upper[axis])
