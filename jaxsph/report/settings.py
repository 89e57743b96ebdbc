"""Settings and circumstances of a run, as names and values that people read."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..io import Overview


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


def environment_rows(environment: Mapping[str, Mapping[str, Any]]) -> dict[str, str]:
    """Versions, machine and device, a line each."""
    return {name: _text(values) for name, values in environment.items()}


def _text(value: Any) -> str:
    """JSON-like values as people read them."""
    if isinstance(value, Mapping):
        return ", ".join(f"{name.replace('_', ' ')} {_text(v)}" for name, v in value.items())
    if isinstance(value, list | tuple):
        return " ".join(map(_text, value))
    return f"{value:g}" if isinstance(value, float) else str(value)
