"""`jaxsph scenes SCENE`: what one can be given; with `--scale`, what scenes are once built."""

from __future__ import annotations

import inspect
from collections.abc import Sequence

from ..scenes import SCENES
from .options import print_rows
from .scene_functions import argument_lines, made, scene_function, unpacked


def tell_scenes(scene: str | None, scales: Sequence[str]) -> int:
    """Print what a scene can be given, or what it is, or all are, at some scales.

    Args:
        scene: a name or a file with a function; all scenes if none is given.
        scales: at which scenes are built.
    """
    named = SCENES if scene is None else {scene: scene_function(scene)}
    for make in named.values() if scales else ():
        if "scale" not in inspect.signature(make).parameters:
            raise ValueError("--scale: the scene has none; leave it out.")
    for name, make in named.items():
        summary = (inspect.getdoc(make) or "").partition("\n\n" if scene else "\n")[0]
        print(f"{name}: {' '.join(summary.split())}")
        if scene is not None:
            print_rows({f"  {key}": line for key, line in argument_lines(make).items()})
        for scale in scales:
            _tell_built(make, scale)
    return 0


def _tell_built(make, scale: str) -> None:
    scene = made(make, {"scale": scale, **unpacked(make)})
    if not all(scene.space.box.periodic):  # only periodic scenes pack their particles
        scene = made(make, {"scale": scale})
    print(
        f"  {scale:6} {scene.state.position.shape[0]:>7} particles, "
        f"dx = {scene.space.spacing:.4g} m, "
        f"h/dx = {scene.space.smoothing_length / scene.space.spacing:.3g}, "
        f"dt = {scene.time_step:.4g} s, {scene.steps} steps to t = {scene.end_time:g} s\n"
        f"         effects: {', '.join(effect.name for effect in scene.effects)}"
    )
