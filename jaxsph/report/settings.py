"""Settings and circumstances of a run, as names and values that people read."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from typing import Any

from ..io import Overview
from ..version import __version__

CITATION = (
    f"jaxsph {__version__}: differentiable smoothed-particle hydrodynamics and its reduced models "
    "in JAX; and for reduced models Rodriguez et al. (2025), Meshless projection model-order "
    "reduction via reference spaces for smoothed-particle hydrodynamics, arXiv:2507.07830"
)


def scene_rows(overview: Overview) -> dict[str, str]:
    """What was run."""
    schedule = overview.schedule
    return {
        "scene": overview.scene,
        "effects": ", ".join(overview.effects) or "not recorded",
        "particles": f"{overview.particles}, in {overview.dim} dimensions, {overview.dtype}",
        "stepping": f"dt = {schedule.time_step:g} s, a snapshot every {schedule.interval:g} s",
        **parameter_rows(overview.parameters),
    }


def parameter_rows(parameters: Mapping[str, Any]) -> dict[str, str]:
    """The record of a scene's parameters; those not given have the scene's own values."""
    return {
        name.replace("_", " "): _text(value)
        for name, value in parameters.items()
        if value is not None
    }


def origin_rows(
    environment: Mapping[str, Mapping[str, Any]], command: str | None = None
) -> dict[str, str]:
    """How a result came about: the command, if it was one, the time, versions, machine and device,
    and what to cite."""
    rows = {} if command is None else {"command": command}
    rows["made"] = datetime.now().astimezone().isoformat(" ", "minutes")
    rows |= {name: _text(values) for name, values in environment.items()}
    return {**rows, "cite": CITATION}


def _text(value: Any) -> str:
    """JSON-like values as people read them."""
    if isinstance(value, Mapping):
        return ", ".join(f"{name.replace('_', ' ')} {_text(v)}" for name, v in value.items())
    if isinstance(value, list | tuple):
        return " ".join(map(_text, value))
    return f"{value:g}" if isinstance(value, float) else str(value)
