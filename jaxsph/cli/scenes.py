"""`jaxsph scenes SCENE`: what one can be given; with `--scale`, what scenes are once built."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from typing import Any

from ..scenes import SCENES, Scene
from .options import print_rows
from .scene_functions import argument_lines, made, scene_function, unpacked


def tell_scenes(scene: str | None, scales: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Print what a scene can be given, or what it is, or all are, at some scales.

    What is printed is handed back by the scenes' names, JSON-like.

    Args:
        scene: a name or a file with a function; all scenes if none is given.
        scales: at which scenes are built.
    """
    named = SCENES if scene is None else {scene: scene_function(scene)}
    for make in named.values() if scales else ():
        if "scale" not in inspect.signature(make).parameters:
            raise ValueError("--scale: the scene has none; leave it out.")
    told: dict[str, dict[str, Any]] = {}
    for name, make in named.items():
        summary = (inspect.getdoc(make) or "").partition("\n\n" if scene else "\n")[0]
        told[name] = {"summary": " ".join(summary.split())}
        print(f"{name}: {told[name]['summary']}")
        if scene is not None:
            told[name]["settings"] = argument_lines(make)
            print_rows({f"  {key}": line for key, line in told[name]["settings"].items()})
        if scales:
            told[name]["built"] = {scale: _tell_built(make, scale) for scale in scales}
    return told


def _tell_built(make: Callable[..., Scene], scale: str) -> dict[str, Any]:
    scene = made(make, {"scale": scale, **unpacked(make)})
    if not all(scene.space.box.periodic):  # only periodic scenes pack their particles
        scene = made(make, {"scale": scale})
    built = {
        "particles": scene.state.position.shape[0],
        "spacing": scene.space.spacing,
        "h_over_dx": scene.space.smoothing_length / scene.space.spacing,
        "time_step": scene.time_step,
        "steps": scene.steps,
        "end_time": scene.end_time,
        "effects": [effect.name for effect in scene.effects],
    }
    print(
        f"  {scale:6} {built['particles']:>7} particles, dx = {built['spacing']:.4g} m, "
        f"h/dx = {built['h_over_dx']:.3g}, dt = {built['time_step']:.4g} s, {built['steps']} steps "
        f"to t = {built['end_time']:g} s\n         effects: {', '.join(built['effects'])}"
    )
    return built
