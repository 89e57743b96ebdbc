"""`jaxsph sweep SCENE`: full models at many Reynolds numbers and seeds, in one file."""

from __future__ import annotations

import argparse
import itertools
import time as clock
from pathlib import Path

import jax
import numpy as np

from jaxsph_command.config import NAME, write_config
from jaxsph_command.errors import Parser

from ..environment import environment
from ..integrate import explanation
from ..progress import progress_bar
from ..sweeps import sweep, sweep_file
from .options import (
    add_json_option,
    positive_int,
    print_rows,
    result_file,
    reynolds_numbers,
    write_json,
)
from .scene_functions import made, name_of, scene_function
from .scene_options import add_scene_options, scene_settings

_FAULTS_SHOWN = 5
_APART = {
    "reynolds": {"type": reynolds_numbers, "nargs": "+", "required": True, "help": "Reynolds "
                 "numbers, or START:STOP:COUNT for COUNT of them, evenly spaced"},
    "seed": {"nargs": "+"},
}  # fmt: skip


def add_to(parser: Parser, words: list[str]) -> None:
    """Add the command's options to its parser."""
    parser.description = (
        "Run full models of a scene at all pairs of the Reynolds numbers and seeds "
        "given, on all devices, and write them to one file, each with its status. The same command "
        "goes on where it was cut short."
    )
    parser.set_defaults(command=_sweep)
    add = parser.add_argument
    add("--batch", type=positive_int, default=1, metavar="K",
        help="members that a device runs side by side; more than one pays on an accelerator "
        "(default: %(default)s)")  # fmt: skip
    add("--out", type=Path, metavar="DIR", help="folder of the results, or a file "
        "ending with .h5 (default: out/SCENE)")
    add_json_option(parser)
    add_scene_options(parser, words, _APART)  # last: its settings leave taken options alone


def _sweep(options) -> int:
    make = options.make or scene_function(options.scene)
    path = result_file(options.out, Path("out", name_of(options.scene, make)), "sweep.h5")
    precision = options.precision or "float64"
    pairs = itertools.product(sum(options.reynolds, []), options.seed or [None])
    with jax.enable_x64(precision == "float64"):
        scenes = []
        for reynolds, number in pairs:
            member = argparse.Namespace(**{**vars(options), "reynolds": reynolds, "seed": number})
            scenes.append(made(make, scene_settings(member, make, precision)))
        before = clock.perf_counter()
        sweep_file.create(path, scenes)  # meets a file of something else
        write_config(path.with_name(NAME), options)
        with progress_bar(len(scenes), "run") as bar:
            status = sweep(scenes, path, batch=options.batch, progress=bar.update)
    lost = np.flatnonzero(status.code)
    for number in lost[:_FAULTS_SHOWN]:
        print(
            f"member {number} (Re {status.parameters[number]['reynolds']:g}): step "
            f"{status.step[number]}: {explanation(int(status.code[number]))}."
        )
    rows = {
        "members": f"{len(scenes)}, {len(lost)} lost",
        "particles": f"{scenes[0].state.density.shape[0]} each",
        "steps": f"{scenes[0].steps}, to t = {scenes[0].end_time:g} s",
        "time": f"{clock.perf_counter() - before:.3g} s, compilation in it",
        "sweep": str(path),
    }
    print_rows(rows)
    write_json(options.json, {**rows, **environment()})
    return 1 if len(lost) == len(scenes) else 0
