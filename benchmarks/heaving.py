"""What is read off a heave: its period."""

from __future__ import annotations

import numpy as np


def period(time: np.ndarray, height: np.ndarray, crossings: int) -> float:
    """Twice the mean time [s] between the first crossings of zero; NaN where there are fewer.

    Args:
        time: [s].
        height: above the place at rest [m].
        crossings: how many are taken.
    """
    before = np.flatnonzero(height[:-1] * height[1:] < 0.0)[:crossings]
    if len(before) < crossings:
        return float("nan")
    a, b = height[before], height[before + 1]
    at = time[before] + (time[before + 1] - time[before]) * a / (a - b)
    return float(2.0 * np.diff(at).mean())
