"""A scene made again from the record of its parameters."""

from __future__ import annotations

import dataclasses
import inspect
from typing import Any

from .. import arrangements, effects, kernels, schemes
from ..arrangements import Arrangement
from ..effects import Effect
from ..kernels import Kernel
from ..schemes import DeltaPlus, Scheme
from .scene import Scene


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
    options = dict(parameters)
    if "kernel" in options:
        options["kernel"] = _named(kernels, Kernel, options["kernel"])()
    if "scheme" in inspect.signature(make).parameters:  # records from before there were any lack it
        named = options.get("scheme", DeltaPlus.__name__)
        options["scheme"] = _named(schemes, Scheme, named)()
    if options.get("wall_velocity") is not None:
        options["wall_velocity"] = _named(effects, Effect, options["wall_velocity"])()
    if arrangement is not None:
        options["arrangement"] = arrangement
    elif "arrangement" in options:
        settings = dict(options["arrangement"])
        rule = _named(arrangements, Arrangement, settings.pop("rule", None))
        try:
            options["arrangement"] = rule(**settings)
        except TypeError as error:
            raise ValueError(f"arrangement: {error}.") from None
    return dataclasses.replace(make(**options), parameters=parameters)


def _named(module, base: type, name: Any) -> type:
    """The class of that name which `module` offers."""
    offered = {
        key: value
        for key, value in vars(module).items()
        if isinstance(value, type) and issubclass(value, base) and not inspect.isabstract(value)
    }
    if name not in offered:
        raise ValueError(
            f"{base.__name__.lower()}: {name!r} is not known; choose one of {', '.join(offered)}."
        )
    return offered[name]
