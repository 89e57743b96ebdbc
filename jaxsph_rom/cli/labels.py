"""`jaxsph-rom labels SCENE`: full runs in, the file of a reduced model on labels out."""

from __future__ import annotations

from pathlib import Path

import jax

from jaxsph.cli import Parser, fail, positive_int, print_rows
from jaxsph.cli.options import add_json_option, bytes_in, bytes_told, result_file, write_json
from jaxsph.cli.scene_functions import made, name_of
from jaxsph.cli.scene_options import add_scene_options, scene_settings
from jaxsph.environment import environment
from jaxsph.integrate import SimulationError
from jaxsph.io import check_target
from jaxsph_command.config import NAME, write_config

from ..labels import check_run, train, training_scenes
from ..points import QDEIM, Family
from ..study import full_run
from .options import REYNOLDS, bar, combinations, said, trained_at, training_values


def add_to(parser: Parser, words: list[str]) -> None:
    """Add the command's options to its parser."""
    parser.description = (
        "Run full models with a free surface, make a reduced model on the particles' labels from "
        "them, and write it to a file from which `jaxsph-rom predict` runs it at any of its "
        "parameters. Full runs are kept: the same command goes on where it was cut short."
    )
    add = parser.add_argument
    add("--train", type=training_values, nargs="+", required=True, metavar="NAME=VALUE",
        help="parameters of the scene to train on, several values with commas between them, or "
        "START:STOP:COUNT; all combinations are run")  # fmt: skip
    add("--modes", type=positive_int, default=4, metavar="M",
        help="coordinates that have rates (default: %(default)s)")  # fmt: skip
    add("--recovered", type=positive_int, default=12, metavar="R",
        help="modes of motion and of density that fields are made of "
        "(default: %(default)s)")  # fmt: skip
    add("--samples", type=positive_int, metavar="N",
        help="take rates of N particles as they move, by the full functional at each and at its "
        "neighbours (default: rates are learnt, as tensors)")  # fmt: skip
    add("--runs", type=Path, metavar="DIR",
        help="where full runs are kept (default: --out, or out/labels-SCENE)")  # fmt: skip
    add("--out", type=Path, metavar="DIR", help="folder of the model and its "
        "full runs, or a file ending with .h5 (default: out/labels-SCENE)")
    add_json_option(parser)
    add_scene_options(parser, words, REYNOLDS)
    parser.set_defaults(command=_labels, precision="float64")


def _labels(options) -> int:
    usual = Path("out", f"labels-{name_of(options.scene, options.make)}")
    path = result_file(options.out, options.runs or usual, "model.h5")
    folder = options.runs or (usual if options.out in (None, path) else options.out)
    check_target(path)
    with jax.enable_x64(options.precision == "float64"):
        parameters = combinations(trained_at(options))
        settings = scene_settings(options, options.make, options.precision)
        family = Family(lambda **named: made(options.make, {**settings, **named}))
        sampling = None if options.samples is None else QDEIM(options.samples)
        scenes = training_scenes(family, parameters, options.modes, sampling)
        runs = []
        try:
            for scene, named in zip(scenes, parameters, strict=True):
                runs.append(full_run(folder / "full", scene, bar, said(named)))
                check_run(scene, runs[-1], named)
            trained = train(
                family, parameters, options.modes, runs=runs, recovered=options.recovered,
                sampling=sampling,
            )  # fmt: skip
        except SimulationError as error:
            return fail("jaxsph-rom", f"full model: {error}", 1)
        except KeyboardInterrupt:
            return fail("jaxsph-rom", "interrupted; the same command goes on from here.", 130)
        trained.save(path)
        write_config(path.with_name(NAME), options)
    seconds = sum(r.timing.seconds(s.steps) for s, r in zip(scenes, runs, strict=True))
    results = {
        "scene": trained.scene,
        "modes": trained.system.size,
        "labels": len(trained.labels),
        "end_time": trained.schedule.end_time,
        **trained.training,
        "full_seconds": seconds,
        "model": path,
    }
    write_json(options.json, {**results, **environment()})
    told = trained.training
    print_rows({
        "scene": f"{trained.scene}, {len(trained.labels)} particles, to t = "
        f"{trained.schedule.end_time:g} s",
        "trained on": "; ".join(said(named) for named in reversed(parameters)),
        "modes": f"{trained.system.size} of {trained.motion.size}",
        "full runs": f"{seconds:.3g} s",
        "offline": f"{told['offline_seconds']:.3g} s (decompose, {_made_by(told)})",
        "error on its runs": f"{100.0 * told['error']:.3g} % of the coordinates",
        "model": f"{path}, {bytes_told(path.stat().st_size)}",
        "runs kept": f"{bytes_told(bytes_in(folder / 'full'))} in {folder / 'full'}",
    })  # fmt: skip
    return 0


def _made_by(told) -> str:
    return f"{told['members']} particles followed" if "members" in told else "learn"
