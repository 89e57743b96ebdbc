"""`jaxsph run SCENE`: a full model, from its start or from what a file holds of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import jax

from ..io import TrajectoryWriter, check_target
from ..scenes import SCENES
from ..scenes.lid_driven_cavity import LIDS
from .options import ARRANGEMENTS, SCALES, STEPPING, margin, positive_float, positive_int, seed
from .recorded import REPORT, simulate_and_report
from .resume import add_resume_options, check_resume_options, resume
from .scenes import takes, unpacked

# options that say what is run, and the scene's name for each; a resumed run has them from its file
_SCENE_OPTIONS = {
    "resolution": "resolution",
    "reynolds": "reynolds",
    "t_end": "end_time",
    "scale": "scale",
    "h_over_dx": "h_over_dx",
    "time_step": "time_step",
    "arrangement": "arrangement",
    "seed": "arrangement",
    "lid": "lid",
    "precision": "dtype",
}
_STEPS_HELP = (
    "fixed: dt throughout; automatic: as long as sound, viscosity, tension and forces allow "
    "(default: fixed; give it again with --resume)"
)
_MARGIN_HELP = (
    "room in the neighbour list over its need at the start; another one rounds sums otherwise "
    "(default: the scene's)"
)


def add_to(commands) -> None:
    """Add the command to a parser's commands."""
    run = commands.add_parser(
        "run",
        help="run a full model",
        description="Run a full model; its snapshots go to DIR/trajectory.h5 as they are made, and "
        f"at the end what came of it to DIR/{REPORT}.",
    )
    run.set_defaults(command=_run)
    add = run.add_argument
    add("scene", metavar="SCENE", help=f"one of {', '.join(SCENES)}")
    add("--resolution", type=positive_int, metavar="N", help="particles per longest side")
    add("--reynolds", type=positive_float, metavar="RE", help="Reynolds number")
    add("--t-end", type=positive_float, metavar="T", help="end time [s]")
    add("--scale", choices=SCALES, help="size of the run (default: small)")
    add("--h-over-dx", type=positive_float, metavar="X", help="smoothing length over spacing")
    add("--time-step", type=positive_float, metavar="DT", help="time step [s]")
    add(
        "--arrangement",
        choices=tuple(ARRANGEMENTS),
        help="how particles start (default: the scene's)",
    )
    add("--seed", type=seed, metavar="N", help="of the arrangement (default: 0)")
    add("--lid", choices=tuple(LIDS), help="profile of the lid (default: regularised)")
    add("--precision", choices=("float32", "float64"), help="default: float64")
    add("--steps", choices=tuple(STEPPING), default="fixed", help=_STEPS_HELP)
    add("--capacity-margin", type=margin, metavar="X", help=_MARGIN_HELP)
    add("--out", type=Path, metavar="DIR", help="folder of the results (default: out/SCENE)")
    add("--json", type=Path, metavar="FILE", help="write the results to FILE as well")
    add("--overwrite", action="store_true", help="replace a trajectory.h5 that is there")
    add_resume_options(run)


def _run(options) -> int:
    if options.scene not in SCENES:
        raise ValueError(
            f"scene: {options.scene!r} is not known; choose one of {', '.join(SCENES)}."
        )
    if options.json is not None:
        check_target(options.json)
    given = [name for name in _SCENE_OPTIONS if getattr(options, name) is not None]
    check_resume_options(options, [_flag(name) for name in given])
    if options.resume is not None:
        return resume(options)
    path = (Path("out", options.scene) if options.out is None else options.out) / "trajectory.h5"
    check_target(path, options.overwrite)
    check_target(path.with_name(REPORT))
    precision = options.precision or "float64"
    with jax.enable_x64(precision == "float64"):
        make = SCENES[options.scene]
        settings = _settings(options, make, precision)
        make(**{**settings, **unpacked(make)})  # meets all bad input before the packing
        scene = make(**settings)
        model = scene.model(margin=options.capacity_margin)
        writer = TrajectoryWriter.create(path, scene, overwrite=options.overwrite)
        return simulate_and_report(options, scene, model, writer, 0)


def _settings(options, make, precision: str) -> dict[str, Any]:
    """What is given on the command line, in the scene's own words."""
    settings = {}
    for option, name in _SCENE_OPTIONS.items():
        value = getattr(options, option)
        if value is None:
            continue
        if name not in takes(make):
            raise ValueError(f"{_flag(option)}: scene {options.scene} has no such setting.")
        settings[name] = value
    if "arrangement" in settings:
        rule = ARRANGEMENTS[options.arrangement or "packed"]
        settings["arrangement"] = rule(seed=options.seed or 0)
    return {**settings, "dtype": precision} if "dtype" in takes(make) else settings


def _flag(option: str) -> str:
    return "--" + option.replace("_", "-")
