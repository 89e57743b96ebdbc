"""`jaxsph sweep SCENE`: full models at many Reynolds numbers and seeds, in one file."""

from __future__ import annotations

import argparse
import itertools
import time as clock
from pathlib import Path

import jax
import numpy as np

from ..integrate import explanation
from ..progress import progress_bar
from ..sweeps import sweep
from .options import positive_int, print_rows, reynolds_numbers, seed
from .scene_functions import is_file, made, scene_function
from .scene_options import add_scene_options, scene_settings

_FAULTS_SHOWN = 5


def add_to(commands) -> None:
    """Add the command to a parser's commands."""
    command = commands.add_parser(
        "sweep",
        help="run a scene at many Reynolds numbers and seeds",
        description="Run full models of a scene at all pairs of the Reynolds numbers and seeds "
        "given, on all devices, and write them to one file, each with its status. The same command "
        "goes on where it was cut short.",
    )
    command.set_defaults(command=_sweep)
    add = command.add_argument
    add_scene_options(add)
    add("--reynolds", type=reynolds_numbers, nargs="+", required=True, metavar="RE",
        help="Reynolds numbers, or START:STOP:COUNT for COUNT of them, evenly spaced")  # fmt: skip
    add("--seed", type=seed, nargs="+", metavar="N", help="of the arrangement (default: 0)")
    add("--batch", type=positive_int, default=1, metavar="K",
        help="members that a device runs side by side; more than one pays on an accelerator "
        "(default: %(default)s)")  # fmt: skip
    add("--out", type=Path, metavar="FILE", help="default: out/SCENE/sweep.h5")


def _sweep(options) -> int:
    make = scene_function(options.scene)
    name = make.__name__ if is_file(options.scene) else options.scene
    path = options.out or Path("out", name, "sweep.h5")
    precision = options.precision or "float64"
    pairs = itertools.product(sum(options.reynolds, []), options.seed or [None])
    with jax.enable_x64(precision == "float64"):
        scenes = []
        for reynolds, number in pairs:
            member = argparse.Namespace(**{**vars(options), "reynolds": reynolds, "seed": number})
            scenes.append(made(make, scene_settings(member, make, precision)))
        before = clock.perf_counter()
        with progress_bar(len(scenes), "run") as bar:
            status = sweep(scenes, path, batch=options.batch, progress=bar.update)
    lost = np.flatnonzero(status.code)
    for number in lost[:_FAULTS_SHOWN]:
        print(
            f"member {number} (Re {status.parameters[number]['reynolds']:g}): step "
            f"{status.step[number]}: {explanation(int(status.code[number]))}."
        )
    print_rows(
        {
            "members": f"{len(scenes)}, {len(lost)} lost",
            "particles": f"{scenes[0].state.density.shape[0]} each",
            "steps": f"{scenes[0].steps}, to t = {scenes[0].end_time:g} s",
            "time": f"{clock.perf_counter() - before:.3g} s, compilation in it",
            "sweep": str(path),
        }
    )
    return 1 if len(lost) == len(scenes) else 0
