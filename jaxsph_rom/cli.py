"""The command line: `jaxsph-rom run SCENE`."""

from __future__ import annotations

import argparse
import dataclasses
import sys
from contextlib import contextmanager
from functools import partial
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
from .projection import (
    AdjointPetrovGalerkin,
    ConvectiveMemory,
    Galerkin,
    MemoryLength,
    SpectralMemory,
)
from .report import format_table
from .study import PLANS, Plan, Study, write_study

PRODUCTS = {"euclidean": Euclidean, "energy": Energy}
ADVECTIONS = {"paper": PaperAdvection, "consistent": ConsistentAdvection}
PROJECTIONS = ("galerkin", "apg")
MEMORIES = {rule.name: rule for rule in (SpectralMemory(), ConvectiveMemory())}


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
    add("--train", type=positive_float, nargs="+", metavar="RE",
        help=f"Reynolds numbers to train on ({_defaults('train')})")  # fmt: skip
    add("--predict", type=positive_float, nargs="+", metavar="RE",
        help=f"Reynolds numbers to run at ({_defaults('predict')})")  # fmt: skip
    add("--modes", type=positive_int, nargs="+", metavar="M",
        help=f"numbers of modes ({_defaults('modes')})")  # fmt: skip
    add("--borders", type=positive_float, nargs="+", metavar="RE",
        help="borders of local bases over Re; two around all of them make one global basis "
        f"({_defaults('borders')}; else a global basis)")  # fmt: skip
    add("--projection", choices=PROJECTIONS, nargs="+", default=["galerkin"],
        help="Galerkin, adjoint Petrov-Galerkin, or both (default: galerkin)")  # fmt: skip
    add("--tau", type=_memory, metavar="T",
        help="memory length of apg [s], or a rule that finds it: 'auto' from the projected "
        "Jacobian's spectral radius, 'convective' from that of its convective part "
        f"({_defaults('tau')})")  # fmt: skip
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
    add("--settling", type=positive_float, metavar="T",
        help="time a run from rest takes before the studied time begins [s] "
        f"({_defaults('settling')}; other scenes start from rest)")  # fmt: skip
    add("--slice", type=float, dest="slice_at", metavar="X",
        help="compare on the vertical line at x = X [m] (default: the centre line; open-cavity "
        "0.25)")  # fmt: skip
    add("--arrangement", choices=tuple(ARRANGEMENTS), help="how particles start (default: the "
        "scene's)")  # fmt: skip
    add("--seed", type=seed, metavar="N", help="of the arrangement (default: 0)")
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
        plan = _plan(options)
        experiments = plan.experiments()
        study = _study(options, plan, folder)
        outcomes = []
        try:
            for experiment in experiments:
                study.check(experiment)
            for experiment in experiments:
                outcomes += study.run(experiment)
        except SimulationError as error:
            return fail("jaxsph-rom", f"full model: {error}", 1)
        except KeyboardInterrupt:
            return fail("jaxsph-rom", "interrupted; the same command goes on from here.", 130)
        write_study(study, experiments, outcomes, folder, report)
    print(format_table([outcome.case for outcome in outcomes]))
    if plan.judged_from:
        print(f"peaks and medians are taken from t = {plan.judged_from:g} s on")
    print(f"\nreport: {report}\nfigures: {folder}/*.png")
    return 0


def _memory(text: str) -> float | MemoryLength:
    """A memory length [s], or the rule of that name."""
    if text in MEMORIES:
        return MEMORIES[text]
    try:
        return positive_float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"a time in s, {' or '.join(MEMORIES)}, got {text!r}"
        ) from None


def _defaults(name: str) -> str:
    """The defaults of an option, scene by scene."""
    found: dict[str, list[str]] = {}
    for scene, plan in PLANS.items():
        value = getattr(plan, name)
        if value is not None:
            text = " ".join(f"{v:g}" for v in (value if isinstance(value, tuple) else (value,)))
            found.setdefault(text, []).append(scene)
    return "default: " + "; ".join(f"{text} for {', '.join(s)}" for text, s in found.items())


def _plan(options) -> Plan:
    """The scene's plan with what is given on the command line."""
    plan = PLANS.get(options.scene)
    if plan is None:
        missing = [f"--{n}" for n in ("train", "predict", "modes") if getattr(options, n) is None]
        if missing:
            raise ValueError(
                f"scene {options.scene} has no plan of its own; give {', '.join(missing)}."
            )
        plan = Plan((), (), (), 1e-4)
    given = {}
    for name in ("train", "predict", "modes", "borders"):
        if getattr(options, name) is not None:
            given[name] = tuple(dict.fromkeys(getattr(options, name)))
    for name in ("slice_at", "settling"):
        if getattr(options, name) is not None:
            given[name] = getattr(options, name)
    if {"train", "predict"} & set(given) and "borders" not in given:
        given["borders"] = None  # the plan's borders belong to its own Reynolds numbers
    return dataclasses.replace(plan, **given)


def _study(options, plan: Plan, folder: Path) -> Study:
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
    for reynolds in (*plan.train, *plan.predict):  # meets bad input before the packing
        cheap = make(reynolds=reynolds, arrangement=ARRANGEMENTS["lattice"](seed=0), **settings)
        plan.probes(cheap)
    if options.arrangement is not None or options.seed is not None:
        rule = ARRANGEMENTS[options.arrangement or "packed"]
        settings["arrangement"] = rule(seed=options.seed or 0)

    scene = plan.scenes(partial(make, **settings), folder, _bar)
    memory = plan.tau if options.tau is None else options.tau
    if not isinstance(memory, MemoryLength):
        memory = AdjointPetrovGalerkin(jax.numpy.asarray(memory, options.precision))
    projections = {"galerkin": Galerkin(), "apg": memory}
    return Study(
        lambda reynolds: scene(reynolds=reynolds),
        folder,
        projections=tuple(projections[name] for name in dict.fromkeys(options.projection)),
        product=PRODUCTS[options.inner_product](),
        advection=ADVECTIONS[options.advection](),
        spline_order=options.spline_order,
        progress=_bar,
        probes=plan.probes,
        judged_from=plan.judged_from,
    )


@contextmanager
def _bar(label: str, total: int, done: int):
    interval = 0.1 if sys.stderr.isatty() else 10.0  # spare log files
    with tqdm(
        desc=label, total=total, initial=done, unit="step", file=sys.stderr, mininterval=interval
    ) as bar:
        yield bar.update
