"""`jaxsph scenes`: what can be run."""

from __future__ import annotations

import inspect
from typing import Any

from ..arrangements import Lattice
from ..scenes import SCENES
from .options import SCALES, print_rows
from .scene_functions import argument_lines, scene_function


def add_to(commands) -> None:
    """Add the command to a parser's commands."""
    scenes = commands.add_parser("scenes", help="list the scenes, their effects and sizes")
    scenes.set_defaults(command=_list_scenes)
    scenes.add_argument(
        "scene",
        nargs="?",
        metavar="SCENE",
        help="tell what this one can be given: a name, or my_scene.py:function",
    )
    scenes.add_argument(
        "--scale", choices=SCALES, action="append", help="sizes to list (default: small)"
    )


def _list_scenes(options) -> int:
    if options.scene is not None:
        make = scene_function(options.scene)
        summary = (inspect.getdoc(make) or "").partition("\n\n")[0]
        print(f"{options.scene}: {' '.join(summary.split())}")
        print_rows({f"  {name}": line for name, line in argument_lines(make).items()})
        return 0
    for name, make in SCENES.items():
        print(f"{name}: {(inspect.getdoc(make) or '').partition(chr(10))[0]}")
        for number, scale in enumerate(options.scale or SCALES[:1]):
            scene = make(scale=scale, **unpacked(make))
            if not all(scene.space.box.periodic):  # only periodic scenes pack their particles
                scene = make(scale=scale)
            if number == 0:
                print(f"  effects: {', '.join(effect.name for effect in scene.effects)}")
            print(
                f"  {scale:6} {scene.state.position.shape[0]:>7} particles, "
                f"dx = {scene.space.spacing:.4g} m, "
                f"h/dx = {scene.space.smoothing_length / scene.space.spacing:.3g}, "
                f"dt = {scene.time_step:.4g} s, {scene.steps} steps to t = {scene.end_time:g} s"
            )
    return 0


def unpacked(make) -> dict[str, Any]:
    """Options that spare the packing where only a scene's settings matter."""
    return {"arrangement": Lattice()} if "arrangement" in takes(make) else {}


def takes(make):
    """What a scene's function can be given, by name."""
    return inspect.signature(make).parameters
