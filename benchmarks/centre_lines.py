"""Velocities on a cavity's centre lines beside reference solutions: one measure for all codes."""

from __future__ import annotations

from typing import Any

import numpy as np

from jaxsph.metrics import local_quadratic

from .references import ghia
from .references.lid_driven_cavity import LIDS, PROBE_RADIUS, solve

VERTICAL = np.stack([np.full(len(ghia.VERTICAL_Y), 0.5), ghia.VERTICAL_Y], axis=1)
HORIZONTAL = np.stack([ghia.HORIZONTAL_X, np.full(len(ghia.HORIZONTAL_X), 0.5)], axis=1)


def centre_line_errors(time, position, velocity, spacing, reynolds, lid) -> dict[str, Any]:
    """Largest deviations on the centre lines, in percent of the lid's speed, at the end.

    The velocity is the mean over the last second, by local quadratic fits; how much it has changed
    before the last ten seconds, or in the first of a shorter run, says how steady it is.

    Args:
        time: of the snapshots, shape (K,) [s].
        position: of the particles in the unit square, shape (K, N, 2) [m].
        velocity: theirs, shape (K, N, 2) [m/s]; the lid's is 1 m/s.
        spacing: of the particles [m].
        reynolds: of the flow.
        lid: `constant` or `regularised`.
    """
    end = time[-1]

    def found(points, component, until=end):
        second = (time > until - 1.0) & (time <= until)
        inside = (points > 0.0).all(axis=1) & (points < 1.0).all(axis=1)
        values = [
            local_quadratic(
                points[inside],
                position[k],
                velocity[k][:, component],
                PROBE_RADIUS * spacing,
            )
            for k in np.flatnonzero(second)
        ]
        return inside, np.mean(values, axis=0)

    exact = solve(reynolds, LIDS[lid])
    (on_u, u), (on_v, v) = found(VERTICAL, 0), found(HORIZONTAL, 1)
    reference_u = exact.velocity(VERTICAL[on_u])[:, 0]
    reference_v = exact.velocity(HORIZONTAL[on_v])[:, 1]
    before = max(1.0, end - 10.0)
    middle = found(VERTICAL, 0, before)[1], found(HORIZONTAL, 1, before)[1]
    errors = {
        "change_percent": 100.0
        * max(float(np.abs(a - b).max()) for a, b in zip((u, v), middle, strict=True)),
        "change_over_seconds": float(end - before),
        "u_error_percent": float(100.0 * np.abs(u - reference_u).max()),
        "v_error_percent": float(100.0 * np.abs(v - reference_v).max()),
        "profiles": {
            "y": VERTICAL[on_u, 1], "u": u, "u_reference": reference_u,
            "x": HORIZONTAL[on_v, 0], "v": v, "v_reference": reference_v,
        },
    }  # fmt: skip
    if lid == "constant" and reynolds in ghia.U:
        apart_u = np.abs(u - published("u", reynolds)[on_u])
        apart_v = np.abs(v - published("v", reynolds)[on_v])
        errors |= {
            "ghia_u_error_percent": float(100.0 * np.nanmax(apart_u)),
            "ghia_v_error_percent": float(100.0 * np.nanmax(apart_v)),
            "ghia_errors_by_point_percent": {
                "y": VERTICAL[on_u, 1], "u": 100.0 * apart_u,
                "x": HORIZONTAL[on_v, 0], "v": 100.0 * apart_v,
            },
        }  # fmt: skip
    return errors


def published(component: str, reynolds: int) -> np.ndarray:
    """A column of Ghia's tables, NaN where an entry is a misprint."""
    column = np.array({"u": ghia.U, "v": ghia.V}[component][reynolds])
    column[[k for name, number, k in ghia.MISPRINTS if (name, number) == (component, reynolds)]] = (
        np.nan
    )
    return column
