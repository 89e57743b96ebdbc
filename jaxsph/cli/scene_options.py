"""Options that say which scene, and with what settings."""

from __future__ import annotations

from typing import Any

from ..scenes import SCENES
from ..scenes.lid_driven_cavity import LIDS
from ..schemes import SCHEMES
from .options import ARRANGEMENTS, SCALES, positive_float, positive_int, seed
from .scene_functions import own_settings, setting
from .scenes import takes

# options that say what is run, and the scene's name for each; a resumed run has them from its file
_NAMES = {
    "resolution": "resolution",
    "reynolds": "reynolds",
    "t_end": "end_time",
    "scale": "scale",
    "h_over_dx": "h_over_dx",
    "time_step": "time_step",
    "arrangement": "arrangement",
    "seed": "arrangement",
    "lid": "lid",
    "scheme": "scheme",
    "precision": "dtype",
}


def add_scene_options(add) -> None:
    """Add the scene, and the settings that members of a sweep share."""
    add("scene", metavar="SCENE",
        help=f"one of {', '.join(SCENES)}, or a function of your own that returns one, as "
        "my_scene.py:function")  # fmt: skip
    add("--set", type=setting, action="append", default=[], metavar="NAME=VALUE",
        help="any other setting that the scene's function takes (`jaxsph scenes SCENE` lists "
        "them); may be repeated")  # fmt: skip
    add("--resolution", type=positive_int, metavar="N", help="particles per longest side")
    add("--t-end", type=positive_float, metavar="T", help="end time [s]")
    add("--scale", choices=SCALES, help="size of the run (default: small)")
    add("--h-over-dx", type=positive_float, metavar="X", help="smoothing length over spacing")
    add("--time-step", type=positive_float, metavar="DT", help="time step [s]")
    add(
        "--arrangement",
        choices=tuple(ARRANGEMENTS),
        help="how particles start (default: the scene's)",
    )
    add("--lid", choices=tuple(LIDS), help="profile of the lid (default: regularised)")
    add("--scheme", choices=tuple(SCHEMES), help="discretisation (default: the scene's)")
    add("--precision", choices=("float32", "float64"), help="default: float64")


def add_member_options(add) -> None:
    """Add the settings that tell members of a sweep apart, for one run."""
    add("--reynolds", type=positive_float, metavar="RE", help="Reynolds number")
    add("--seed", type=seed, metavar="N", help="of the arrangement (default: 0)")


def given(options) -> list[str]:
    """The settings that are given, as they are typed."""
    named = [_flag(name) for name in _NAMES if getattr(options, name) is not None]
    return named + (["--set"] if options.set else [])


def scene_settings(options, make, precision: str) -> dict[str, Any]:
    """What is given on the command line, in the scene's own words."""
    settings = {}
    for option, name in _NAMES.items():
        value = getattr(options, option)
        if value is None:
            continue
        if name not in takes(make):
            raise ValueError(f"{_flag(option)}: scene {options.scene} has no such setting.")
        settings[name] = value
    if "arrangement" in settings:
        rule = ARRANGEMENTS[options.arrangement or "packed"]
        settings["arrangement"] = rule(seed=options.seed or 0)
    if "scheme" in settings:
        settings["scheme"] = SCHEMES[options.scheme]
    settings |= own_settings(make, options.set)
    return {**settings, "dtype": precision} if "dtype" in takes(make) else settings


def _flag(option: str) -> str:
    return "--" + option.replace("_", "-")
