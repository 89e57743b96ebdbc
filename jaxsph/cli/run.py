"""`jaxsph run SCENE`: a full model, from its start or from what a file holds of it."""

from __future__ import annotations

from pathlib import Path

import jax

from jaxsph_command.config import NAME, write_config
from jaxsph_command.errors import Parser

from ..devices import Devices
from ..io import TrajectoryWriter, check_target
from ..scenes import SCENES
from ..wall_forces import WallForces, named
from .options import STEPPING, add_json_option, margin, positive_int
from .recorded import REPORT, simulate_and_report
from .resume import add_resume_options, check_resume_options, resume
from .scene_functions import made, name_of, scene_function, unpacked
from .scene_options import add_scene_options, given, scene_settings

_STEPS_HELP = (
    "fixed: dt throughout; automatic: as long as sound, viscosity, tension and forces allow "
    "(default: fixed; give it again with --resume)"
)
_MARGIN_HELP = (
    "room in the neighbour list over its need at the start; another one rounds sums otherwise "
    "(default: the scene's)"
)
_DEVICES_HELP = (
    "run by N devices together, each its share of the particles; another N rounds sums otherwise "
    "(default: one; give it again with --resume)"
)


def add_to(parser: Parser, words: list[str]) -> None:
    """Add the command's options to its parser."""
    parser.description = (
        "Run a full model; its snapshots go to DIR/trajectory.h5 as they are made, and "
        f"at the end what came of it to DIR/{REPORT}. DIR/{NAME} runs it again."
    )
    parser.set_defaults(command=_run)
    add = parser.add_argument
    add("--steps", choices=tuple(STEPPING), default="fixed", help=_STEPS_HELP)
    add("--capacity-margin", type=margin, metavar="X", help=_MARGIN_HELP)
    add("--devices", type=positive_int, metavar="N", help=_DEVICES_HELP)
    add("--out", type=Path, metavar="DIR", help="folder of the results (default: out/SCENE)")
    add_json_option(parser)
    add("--overwrite", action="store_true", help="replace a trajectory.h5 that is there")
    add_resume_options(parser)
    add_scene_options(parser, words)  # last: its settings leave taken options alone


def _run(options) -> int:
    make = options.make or scene_function(options.scene)
    if options.devices is not None:
        Devices.first(options.devices)  # are there so many?
    check_resume_options(options, given(options) if options.scene in SCENES else [])
    if options.resume is not None:
        return resume(options, make)
    path = (options.out or Path("out", name_of(options.scene, make))) / "trajectory.h5"
    check_target(path, options.overwrite)
    check_target(path.with_name(REPORT))
    precision = options.precision or "float64"
    with jax.enable_x64(precision == "float64"):
        settings = scene_settings(options, make, precision)
        made(make, {**settings, **unpacked(make)})  # meets all bad input before the packing
        scene = made(make, settings)
        model = scene.model(margin=options.capacity_margin)
        forces = WallForces.of(scene)
        writer = TrajectoryWriter.create(
            path, scene, overwrite=options.overwrite, forces=forces, averaged=named(forces)
        )
        write_config(path.with_name(NAME), options)
        return simulate_and_report(options, scene, model, writer, 0)
