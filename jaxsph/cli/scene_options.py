"""Options that say which scene, and with what settings: those of its function's signature."""

from __future__ import annotations

import ast
import inspect
import sys
from collections.abc import Callable
from typing import Any

from jaxsph_command.errors import Parser

from ..scenes import SCENES, Scene
from ..schemes import SCHEMES
from .kinds import check_kind, plain_kinds
from .options import ARRANGEMENTS, SCALES, finite_float, positive_float, positive_int, seed
from .scene_functions import argument_lines, own_settings, scene_function, scene_word, setting

# settings of most scenes: what each is called there, its option, and how that is read
_SHARED: dict[str, tuple[str, dict[str, Any]]] = {
    "resolution": ("--resolution", {"type": positive_int, "metavar": "N",
                                    "help": "particles per longest side"}),
    "reynolds": ("--reynolds", {"type": positive_float, "metavar": "RE",
                                "help": "Reynolds number"}),
    "end_time": ("--t-end", {"type": positive_float, "metavar": "T", "help": "end time [s]"}),
    "scale": ("--scale", {"choices": SCALES, "help": "size of the run (default: small)"}),
    "h_over_dx": ("--h-over-dx", {"type": positive_float, "metavar": "X",
                                  "help": "smoothing length over spacing"}),
    "time_step": ("--time-step", {"type": positive_float, "metavar": "DT",
                                  "help": "time step [s]"}),
    "arrangement": ("--arrangement", {"choices": tuple(ARRANGEMENTS),
                                      "help": "how particles start (default: the scene's)"}),
    "scheme": ("--scheme", {"choices": tuple(SCHEMES),
                            "help": "discretisation (default: the scene's)"}),
}  # fmt: skip
_SEED = {"type": seed, "metavar": "N", "help": "of the arrangement (default: 0)"}
_NONE: dict[str, Any] = {}
_KINDS = {"int": int, "float": finite_float, "str": str}


def add_scene_options(parser: Parser, words: list[str], apart: dict[str, Any] = _NONE):
    """Add the scene, and all settings that the one named among the words can be given.

    Args:
        parser: of the command.
        words: of the command line, after the command.
        apart: how the Reynolds number and the seed, by which members of a sweep differ, are read
            instead.
    """
    add, scene = parser.add_argument, scene_word(words)
    add("scene", metavar="SCENE",
        help=f"one of {', '.join(SCENES)}; or a function of your own that returns one, as "
        "my_scene.py:function; with it, --help tells its own settings as well")  # fmt: skip
    add("--set", type=setting, action="append", default=[], metavar="NAME=VALUE",
        help="any setting that the scene's function takes; may be repeated")  # fmt: skip
    make = None if scene is None else scene_function(scene)
    takes = _SHARED if make is None else inspect.signature(make).parameters
    settings = {}
    for name, (flag, how) in _SHARED.items():
        if name in takes:
            settings[add(flag, **(how | apart.get(name, {}))).dest] = name
    if "arrangement" in takes:
        settings[add("--seed", **(_SEED | apart.get("seed", {}))).dest] = "arrangement"
    add("--precision", choices=("float32", "float64"), help="default: float64")
    if make is not None:
        parser.subject = f"scene {scene}"
        group = parser.add_argument_group(f"settings of {scene} alone")
        told = argument_lines(make)
        for name, parameter in takes.items():
            if parameter.kind is parameter.VAR_KEYWORD or name == "reynolds":
                continue
            flag = "--" + name.replace("_", "-")
            if name not in (*_SHARED, "dtype") and flag not in parser._option_string_actions:
                how = _read_as(make, parameter)
                line = told[name].replace("%", "%%")
                settings[group.add_argument(flag, help=line, **how).dest] = name
    parser.set_defaults(make=make, named=scene, settings=settings)


def given(options) -> list[str]:
    """The settings that are given, as they are typed."""
    names = [*options.settings, "precision", "set"]
    return ["--" + name.replace("_", "-") for name in names if name in options.typed]


def scene_settings(options, make: Callable[..., Scene], precision: str) -> dict[str, Any]:
    """What is given on the command line, in the scene's own words."""
    if options.named != options.scene:
        raise ValueError(f"scene: name {options.scene} before its options.")
    takes = inspect.signature(make).parameters
    values = {option: getattr(options, option, None) for option in options.settings}
    settings = {options.settings[k]: v for k, v in values.items() if v is not None}
    if "arrangement" in settings:
        rule = ARRANGEMENTS[options.arrangement or "packed"]
        settings["arrangement"] = rule(seed=options.seed or 0)
    if "scheme" in settings:
        settings["scheme"] = SCHEMES[options.scheme]
    given = dict(options.set)
    if "dtype" in given:
        raise ValueError("--set: dtype is given by --precision, as float32 or float64.")
    for name in given.keys() & takes.keys():
        check_kind(takes[name], given[name])
    settings |= given
    settings = own_settings(make, settings.items())
    return {**settings, "dtype": precision} if "dtype" in takes else settings


def _read_as(make: Callable[..., Scene], parameter: inspect.Parameter) -> dict[str, Any]:
    """How argparse reads a setting: by its annotation, or by its default where it has none."""
    metavar = parameter.name.upper()
    words = getattr(sys.modules.get(make.__module__), f"{metavar}S", None)
    if isinstance(words, dict):  # LIDS, of all that `lid` can be
        return {"choices": tuple(words)}
    if parameter.annotation is inspect.Parameter.empty:
        read = _KINDS.get(type(parameter.default).__name__, _literal)
        return {"type": read, "metavar": metavar}
    kinds = plain_kinds(parameter)
    if len(kinds) > 1:
        return {"nargs": len(kinds), "type": _KINDS[kinds[0]], "metavar": metavar[0]}
    return {"type": _KINDS[kinds[0]] if kinds else _literal, "metavar": metavar}


def _literal(text: str) -> Any:
    """A value as Python writes it, or else a word."""
    try:
        return ast.literal_eval(text)
    except (ValueError, SyntaxError):
        return text
