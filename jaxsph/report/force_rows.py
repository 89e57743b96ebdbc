"""Forces on walls, as names and values that people read."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..io import Overview


def force_rows(overview: Overview) -> dict[str, str]:
    """Force, torque, drag and lift on each part of the walls; nothing where none were recorded."""
    force, torque = ("N", "N m") if overview.dim == 3 else ("N/m", "N m/m")
    rows = {}
    for name, told in overview.forces.items():
        if told["last_force"] is None:
            continue
        for kind, unit in (("force", force), ("torque", torque)):
            last, mean = (_vector(told[f"{which}_{kind}"]) for which in ("last", "mean"))
            rows[f"{kind} on {name}"] = f"{mean} {unit} over the last fifth, {last} at last"
        rows |= _coefficients(name, told)
    return rows


def _coefficients(name: str, told: dict[str, Any]) -> dict[str, str]:
    """Nothing where it is not known what they refer to."""
    drag, lift = told["drag_coefficient"], told["lift_coefficient"]
    if not math.isfinite(drag):
        return {}
    of = f"{told['reference_speed']:g} m/s and {told['reference_length']:g} m"
    text = f"drag coefficient {drag:.5g}, lift coefficient {lift:.5g} (last fifth; of {of})"
    return {f"coefficients of {name}": text}


def _vector(value: float | list[float]) -> str:
    text = ", ".join(f"{each:.5g}" for each in np.ravel(value))
    return f"({text})" if np.ndim(value) else text
