"""The command line: `jaxsph-rom run SCENE`."""

from __future__ import annotations

import sys
from contextlib import contextmanager
from pathlib import Path

import jax
from tqdm import tqdm

from jaxsph import __version__
from jaxsph.cli import (
    ARRANGEMENTS,
    SCALES,
    Parser,
    fail,
    positive_float,
    positive_int,
    report_errors,
    seed,
)
from jaxsph.integrate import SimulationError
from jaxsph.io import check_target
from jaxsph.scenes import SCENES

from .basis import Energy, Euclidean
from .field_advection import ConsistentAdvection, PaperAdvection
from .projection import AdjointPetrovGalerkin, Galerkin
from .report import format_table
from .study import Experiment, Study, write_study

PRODUCTS = {"euclidean": Euclidean, "energy": Energy}
ADVECTIONS = {"paper": PaperAdvection, "consistent": ConsistentAdvection}
PROJECTIONS = ("galerkin", "apg")


def main(argv: list[str] | None = None) -> int:
    """The `jaxsph-rom` command. Exit code 0: good, 1: a full run failed, 2: bad input."""
    return report_errors("jaxsph-rom", _command, argv)


def _command(argv) -> int:
    options = _parser().parse_args(argv)
    return options.command(options)


def _parser() -> Parser:
    parser = Parser("jaxsph-rom", description="Projection-based reduced models of SPH flows.")
    parser.add_argument("--version", action="version", version=f"jaxsph-rom {__version__}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    run = commands.add_parser(
        "run",
        help="train, predict, compare with the full model",
        description="Run full models, build reduced models from them, run these at other Reynolds "
        "numbers, and compare: a table of errors and times, figures and report.json. Runs are "
        "kept in the output folder: the same command goes on where it was cut short.",
    )
    run.set_defaults(command=_run)
    add = run.add_argument
    add("scene", metavar="SCENE", help=f"one of {', '.join(SCENES)}")
    add("--train", type=positive_float, nargs="+", default=[100.0, 150.0, 200.0, 250.0],
        metavar="RE", help="Reynolds numbers to train on (default: 100 150 200 250)")  # fmt: skip
    add("--predict", type=positive_float, nargs="+", default=[125.0, 175.0, 225.0],
        metavar="RE", help="Reynolds numbers to run at (default: 125 175 225)")  # fmt: skip
    add("--modes", type=positive_int, nargs="+", default=[3], metavar="M",
        help="numbers of modes (default: 3)")  # fmt: skip
    add("--projection", choices=PROJECTIONS, nargs="+", default=["galerkin"],
        help="Galerkin, adjoint Petrov-Galerkin, or both (default: galerkin)")  # fmt: skip
    add("--tau", type=positive_float, default=1e-4, metavar="T",
        help="memory length of apg [s] (default: %(default)g)")  # fmt: skip
    add("--inner-product", choices=tuple(PRODUCTS), default="energy",
        help="of POD and projection (default: %(default)s; euclidean is the paper's)")  # fmt: skip
    add("--advection", choices=tuple(ADVECTIONS), default="paper",
        help="what is subtracted for the Eulerian functional (default: %(default)s)")  # fmt: skip
    add("--spline-order", type=positive_int, default=3, metavar="K",
        help="of the polyharmonic splines (default: %(default)s)")  # fmt: skip
    add("--scale", choices=SCALES, default="small", help="size of the runs (default: small)")
    add("--resolution", type=positive_int, metavar="N", help="particles per longest side")
    add("--h-over-dx", type=positive_float, metavar="X", help="smoothing length over spacing")
    add("--time-step", type=positive_float, metavar="DT", help="time step [s]")
    add("--t-end", type=positive_float, metavar="T", help="end time [s]")
    add("--arrangement", choices=tuple(ARRANGEMENTS), default="packed",
        help="how particles start (default: %(default)s)")  # fmt: skip
    add("--seed", type=seed, default=0, metavar="N", help="of the arrangement (default: 0)")
    add("--precision", choices=("float32", "float64"), default="float64",
        help="default: %(default)s")  # fmt: skip
    add("--out", type=Path, metavar="DIR", help="folder for all results (default: out/rom-SCENE)")
    add("--json", type=Path, metavar="FILE", help="write the report there, not to DIR/report.json")
    return parser


def _run(options) -> int:
    if options.scene not in SCENES:
        raise ValueError(
            f"scene {options.scene!r} is not known; choose one of {', '.join(SCENES)}."
        )
    folder = Path("out", f"rom-{options.scene}") if options.out is None else options.out
    report = folder / "report.json" if options.json is None else options.json
    check_target(report)
    check_target(folder / "report.json")
    with jax.enable_x64(options.precision == "float64"):
        study, experiment = _study(options, folder)
        study.check(experiment)
        outcomes = []
        try:
            for outcome in study.run(experiment):
                outcomes.append(outcome)
        except SimulationError as error:
            return fail("jaxsph-rom", f"full model: {error}", 1)
        except KeyboardInterrupt:
            return fail("jaxsph-rom", "interrupted; the same command goes on from here.", 130)
        write_study(study, experiment, outcomes, folder, report)
    print(format_table([outcome.case for outcome in outcomes]))
    print(f"\nreport: {report}\nfigures: {folder}/*.png")
    return 0


def _study(options, folder: Path) -> tuple[Study, Experiment]:
    make = SCENES[options.scene]
    settings = {
        "scale": options.scale,
        "resolution": options.resolution,
        "h_over_dx": options.h_over_dx,
        "time_step": options.time_step,
        "dtype": options.precision,
    }
    if options.t_end is not None:
        settings["end_time"] = options.t_end
    for reynolds in (*options.train, *options.predict):  # meets bad input before the packing
        make(reynolds=reynolds, arrangement=ARRANGEMENTS["lattice"](seed=0), **settings)
    arrangement = ARRANGEMENTS[options.arrangement](seed=options.seed)
    projections = {
        "galerkin": Galerkin(),
        "apg": AdjointPetrovGalerkin(jax.numpy.asarray(options.tau, options.precision)),
    }
    study = Study(
        lambda reynolds: make(reynolds=reynolds, arrangement=arrangement, **settings),
        folder,
        projections=tuple(projections[name] for name in dict.fromkeys(options.projection)),
        product=PRODUCTS[options.inner_product](),
        advection=ADVECTIONS[options.advection](),
        spline_order=options.spline_order,
        progress=_bar,
    )
    experiment = Experiment(
        tuple(dict.fromkeys(options.train)),
        tuple(dict.fromkeys(options.predict)),
        tuple(dict.fromkeys(options.modes)),
    )
    return study, experiment


@contextmanager
def _bar(label: str, total: int, done: int):
    interval = 0.1 if sys.stderr.isatty() else 10.0  # spare log files
    with tqdm(
        desc=label, total=total, initial=done, unit="step", file=sys.stderr, mininterval=interval
    ) as bar:
        yield bar.update
