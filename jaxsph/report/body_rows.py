"""Where free bodies are, as names and values that people read."""

from __future__ import annotations

import math

from ..io import Overview


def body_rows(overview: Overview) -> dict[str, str]:
    """Place, angle and velocity of each free body at last; nothing where there are none."""
    rows = {}
    for number, told in enumerate(overview.bodies):
        (x, y), (u, v) = told["position"], told["velocity"]
        (left, low), (right, high) = told["lowest"], told["highest"]
        rows[f"free body {number}"] = (
            f"at ({x:.5g}, {y:.5g}) m, turned by {math.degrees(told['angle']):.4g} degrees, with "
            f"({u:.4g}, {v:.4g}) m/s and {told['spin']:.4g} rad/s at last; it was between "
            f"({left:.5g}, {low:.5g}) and ({right:.5g}, {high:.5g}) m"
        )
    return rows
