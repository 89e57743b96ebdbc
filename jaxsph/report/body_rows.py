"""Where free bodies are, as names and values that people read."""

from __future__ import annotations

import math

import numpy as np

from ..io import Overview


def body_rows(overview: Overview) -> dict[str, str]:
    """Place, angle and velocity of each free body at last; nothing where there are none."""
    rows = {}
    for number, told in enumerate(overview.bodies):
        rows[f"free body {number}"] = (
            f"at {_told(told['position'], 5)} m, turned by {_turn(told['angle'])}, with "
            f"{_told(told['velocity'])} m/s and {_told(told['spin'])} rad/s at last; it was "
            f"between {_told(told['lowest'], 5)} and {_told(told['highest'], 5)} m"
        )
    return rows


def _turn(angle: float | list[float]) -> str:
    """An angle, or a rotation vector, in degrees."""
    size = math.hypot(*np.atleast_1d(angle))
    if np.ndim(angle) == 0 or not size > 0.0:
        return f"{math.degrees(np.sum(angle)):.4g} degrees"
    return f"{math.degrees(size):.4g} degrees about {_told(np.divide(angle, size), 3)}"


def _told(value: float | list[float], digits: int = 4) -> str:
    """A number, or components in brackets."""
    parts = [f"{part:.{digits}g}" for part in np.atleast_1d(value)]
    return parts[0] if np.ndim(value) == 0 else f"({', '.join(parts)})"
