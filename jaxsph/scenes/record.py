"""A scene made again from the record of its parameters."""

from __future__ import annotations

import dataclasses
import inspect
from typing import Any

from .. import arrangements, effects, kernels, schemes
from ..arrangements import Arrangement
from ..effects import Effect
from ..kernels import Kernel
from ..record import restored
from ..schemes import DeltaPlus, Scheme
from .scene import Scene

_RULES = {
    "kernel": (Kernel, kernels),
    "scheme": (Scheme, schemes),
    "wall_velocity": (Effect, effects),
    "arrangement": (Arrangement, arrangements),
}
# what records lack that are from before there was a choice
_BEFORE = {"scheme": DeltaPlus.__name__, "ghosts": "lattice"}


def scene_from_record(
    name: str, parameters: dict[str, Any], arrangement: Arrangement | None = None
) -> Scene:
    """The scene that `Scene.name` and `Scene.parameters` tell of.

    Args:
        name: of the scene.
        parameters: its record, as a trajectory file keeps it.
        arrangement: stands in for the recorded one, which the record still names; a run that goes
            on from stored particles need not pack them again.

    Raises:
        ValueError: if the scene, a parameter, or a name among these is not known here.
    """
    from . import SCENES  # not at the top, so that `scenes` may hand this function on

    if name not in SCENES:
        raise ValueError(f"scene: {name!r} is not known; choose one of {', '.join(SCENES)}.")
    make = SCENES[name]
    unknown = [key for key in parameters if key not in inspect.signature(make).parameters]
    if unknown:
        raise ValueError(
            f"parameters: scene {name} has no {', '.join(unknown)}; the record may come from "
            "another version."
        )
    before = {k: v for k, v in _BEFORE.items() if k in inspect.signature(make).parameters}
    options = {**before, **parameters}
    if arrangement is not None:
        options["arrangement"] = arrangement
    return dataclasses.replace(make(**rules_restored(options)), parameters=parameters)


def rules_restored(settings: dict[str, Any]) -> dict[str, Any]:
    """Settings of a scene with the rules among them made from their records.

    Raises:
        ValueError: if a rule is not known.
    """
    made = {
        key: restored(settings[key], base, package)
        for key, (base, package) in _RULES.items()
        if settings.get(key) is not None and not isinstance(settings[key], base)
    }
    return settings | made
