"""Scenes by name, or from a file of one's own; what each can be given."""

from __future__ import annotations

import argparse
import ast
import importlib.util
import inspect
import re
import sys
import traceback
from collections.abc import Callable, Iterable, Mapping
from importlib.metadata import entry_points
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

from jaxsph_command.errors import meant
from jaxsph_command.scenes import GROUP

from ..arrangements import Lattice
from ..scenes import SCENES, Scene
from ..scenes.record import rules_restored

_ARGUMENT = re.compile(r"^    (\w[\w, ]*): (.*)$")  # of a docstring, and its first line


def is_file(scene: str) -> bool:
    """Whether a scene's name is that of a file, with a function or without."""
    return scene.partition(":")[0].endswith(".py")


def scene_function(scene: str) -> Callable[..., Scene]:
    """What makes a scene of a name, or of `my_scene.py`, or of `my_scene.py:function`.

    Raises:
        ValueError: if there is none, or the file cannot be run.
    """
    if scene in SCENES:
        return SCENES[scene]
    if not is_file(scene):
        return _offered(scene)
    file, _, function = scene.partition(":")
    module = _loaded(Path(file))
    offered = {
        name: value
        for name, value in vars(module).items()
        if isinstance(value, FunctionType)
        and value.__module__ == module.__name__
        and name[0] != "_"
    }
    name = function or (next(iter(offered)) if len(offered) == 1 else "make")
    if name not in offered:
        there = f"it has {', '.join(offered)}" if offered else "it has none"
        raise ValueError(
            f"scene: {file} has no function {name}{meant(name, offered)}; {there}; choose by "
            f"{file}:FUNCTION."
        )
    return offered[name]


def scene_word(words: list[str]) -> str | None:
    """The scene among the words of a command line: the first one, or one that is known."""
    if words and not words[0].startswith("-"):
        return words[0]
    known = {*SCENES, *entry_points(group=GROUP).names}
    return next((word for word in words if word in known or is_file(word)), None)


def name_of(scene: str, make: Callable[..., Scene]) -> str:
    """What results of a scene are called."""
    return make.__name__ if is_file(scene) else scene


def made(make: Callable[..., Scene], settings: Mapping[str, Any]) -> Scene:
    """The scene of a function; what goes wrong in one's own is a ValueError that says where."""
    if make in SCENES.values():
        return make(**settings)
    try:
        scene = make(**settings)
    except ValueError:
        raise
    except (Exception, SystemExit) as error:
        raise ValueError(f"scene: {_fault(error, make.__code__.co_filename)}") from None
    if not isinstance(scene, Scene):
        raise ValueError(
            f"scene: {make.__name__} gives {type(scene).__name__}; let it return a jaxsph Scene."
        )
    return scene


def own_settings(make: Callable[..., Scene], given: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    """Settings of a scene by the names of its function; rules by theirs, as `WendlandC4`.

    Raises:
        ValueError: if the function has no such setting, or there is no such rule.
    """
    settings, takes = dict(given), inspect.signature(make).parameters
    any_name = any(p.kind is p.VAR_KEYWORD for p in takes.values())
    for name in settings:
        if name not in takes and not any_name:
            raise ValueError(
                f"--set: the scene has no {name}{meant(name, takes)}; it has {', '.join(takes)}."
            )
    return rules_restored(settings)


def setting(text: str) -> tuple[str, Any]:
    """NAME=VALUE, the value as Python writes it, or else a word."""
    name, equals, value = text.partition("=")
    if not equals or not name.isidentifier():
        raise argparse.ArgumentTypeError(f"give NAME=VALUE, got {text}")
    try:
        return name, ast.literal_eval(value)
    except (ValueError, SyntaxError):
        return name, value


def unpacked(make: Callable[..., Scene]) -> dict[str, Any]:
    """Options that spare the packing where only a scene's settings matter."""
    takes = inspect.signature(make).parameters
    return {"arrangement": Lattice()} if "arrangement" in takes else {}


def argument_lines(make: Callable[..., Scene]) -> dict[str, str]:
    """What a function can be given: its default, and what its docstring says of it.

    What all scenes can be given is told by the vortex, where a docstring leaves it out.
    """
    told = _told(SCENES["taylor-green"]) | _told(make)
    return {
        name: f"{told.get(name, '')}{_default(parameter.default)}".strip()
        for name, parameter in inspect.signature(make).parameters.items()
    }


def _told(make: Callable[..., Scene]) -> dict[str, str]:
    """What a docstring says of each argument."""
    told: dict[str, str] = {}
    lines = (inspect.getdoc(make) or "").partition("Args:\n")[2].splitlines()
    names: list[str] = []
    for line in lines:
        if line and not line.startswith(" "):
            break
        found = _ARGUMENT.match(line)
        if found:
            names = [name.strip() for name in found[1].split(",")]
        for name in names:
            text = found[2] if found else line.strip()
            told[name] = f"{told.get(name, '')} {text}".strip()
    return told


def _default(value: Any) -> str:
    if value is inspect.Parameter.empty:
        return " (needed)"
    return "" if value is None else f" (default: {value})"


def _offered(scene: str) -> Callable[..., Scene]:
    """A scene of another package."""
    points = entry_points(group=GROUP)
    if scene not in points.names:
        known = (*SCENES, *points.names)
        raise ValueError(
            f"scene: {scene!r} is not known{meant(scene, known)}; choose one of "
            f"{', '.join(known)}, or give a file of your own, as my_scene.py:function."
        )
    try:
        return points[scene].load()
    except Exception as error:
        raise ValueError(
            f"scene: {scene} of {points[scene].value} cannot be loaded ({error})."
        ) from None


def _loaded(path: Path) -> ModuleType:
    if not path.is_file():
        raise ValueError(f"scene: there is no file {path}; check its name and folder.")
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    sys.path.insert(0, str(path.parent.resolve()))  # for what it imports beside it
    sys.modules[path.stem] = module  # by which its classes are found
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        raise ValueError(f"scene: {_fault(error, spec.origin)}") from None
    return module


def _fault(error: Exception, file: str) -> str:
    """What went wrong in a file, and where."""
    lines = [f.lineno for f in traceback.extract_tb(error.__traceback__) if f.filename == file]
    line = lines[-1] if lines else getattr(error, "lineno", None)
    where = f"{Path(file).name}{f', line {line}' if line else ''}"
    return f"{where}: {type(error).__name__}: {error}"
