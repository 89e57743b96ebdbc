"""`jaxsph-rom run SCENE`: train, predict, compare with the full model."""

from __future__ import annotations

import argparse
import json
import textwrap
from dataclasses import replace
from pathlib import Path

import jax

from jaxsph.cli import Parser, fail, positive_float, positive_int
from jaxsph.cli.options import add_json_option, bytes_in, bytes_told, write_json
from jaxsph.cli.scene_functions import name_of
from jaxsph.integrate import SimulationError
from jaxsph.interpolation import MovingLeastSquaresMap, QuadraticMap, ShepardMap
from jaxsph.io import check_target
from jaxsph.scenes import Scene
from jaxsph_command.config import NAME, repeating, write_config

from ..field_advection import ConsistentAdvection, Gauged, ModeAdvection, PaperAdvection
from ..lattice_polynomials import LatticePolynomials
from ..points import Family
from ..points.training.training import check_family
from ..projection import (
    AdjointPetrovGalerkin,
    ConvectiveMemory,
    Galerkin,
    MemoryLength,
    SpectralMemory,
)
from ..report import Case, best, format_table, verdict
from ..report.table import WIDTH
from ..splines import LocalSplines
from ..still_walls import check_still
from ..study import PLANS, OnParticles, OnPoints, Plan, Study, write_study
from ..study.write import MODEL
from .options import (
    PRODUCTS,
    add_closure_options,
    add_training_options,
    bar,
    check_closure,
    defaults,
    distinct,
    formulation,
    planned,
    scene_maker,
    trained_at,
)

MAPS = {"shepard": ShepardMap, "mls": MovingLeastSquaresMap, "quadratic": QuadraticMap}
INTERPOLATIONS = {"splines": LocalSplines, "polynomials": LatticePolynomials}
ADVECTIONS = {
    "modes": ModeAdvection,
    "paper": PaperAdvection,
    "consistent": ConsistentAdvection,
}
BEST = {"inner_product": "energy", "advection": "modes", "map": "quadratic"}
PAPERS = {
    "scheme": "delta-plus", "inner_product": "euclidean", "advection": "paper", "map": "shepard"
}  # fmt: skip
PROJECTIONS = ("galerkin", "apg")
HYPER = ("none", "tensor")
MEMORIES = {rule.name: rule for rule in (SpectralMemory(), ConvectiveMemory())}


def add_to(parser: Parser, words: list[str]) -> None:
    """Add the command's options to its parser."""
    parser.description = (
        "Run full models, build reduced models from them, run these at other Reynolds "
        "numbers, and compare: a table of errors and times, figures, report.json and report.html. "
        "Runs are kept in the output folder: the same command goes on where it was cut short."
    )
    add = parser.add_argument
    add("--predict", type=positive_float, nargs="+", metavar="RE",
        help=f"Reynolds numbers to run at ({defaults('predict')})")  # fmt: skip
    add("--modes", type=positive_int, nargs="+", metavar="M",
        help=f"numbers of modes ({defaults('modes')})")  # fmt: skip
    add("--borders", type=positive_float, nargs="+", metavar="RE",
        help="borders of local bases over Re; two around all of them make one global basis "
        f"({defaults('borders')}; else a global basis)")  # fmt: skip
    add("--hyper", choices=HYPER, nargs="+",
        help="models on moving particles (none), on reference points (tensor), or both; with "
        "tensor all runs start quietly (default: both of taylor-green, with a linear closure; "
        "else none)")  # fmt: skip
    add("--projection", choices=PROJECTIONS, nargs="+", default=["galerkin"],
        help="Galerkin, adjoint Petrov-Galerkin, or both, on moving particles (default: "
        "galerkin)")  # fmt: skip
    add("--tau", type=memory_length, metavar="T",
        help="memory length of apg [s], or a rule that finds it: 'auto' from the projected "
        "Jacobian's spectral radius, 'convective' from that of its convective part "
        f"({defaults('tau')})")  # fmt: skip
    add("--faithful", action="store_true",
        help="the source paper's model as printed, for whatever is not given: --scheme delta-plus "
        "--inner-product euclidean --advection paper --map shepard")  # fmt: skip
    add("--advection", choices=tuple(ADVECTIONS),
        help="what is subtracted for the Eulerian functional: the modes' own advection, or sums "
        "over the particles, of the delta-plus scheme (default: modes)")  # fmt: skip
    add("--gauge", action="store_true",
        help="hold the mean density, where the fluid fills its domain")
    add("--map", choices=tuple(MAPS),
        help="of particles to reference points: Shepard's, or moving least squares, which keep "
        "linear (mls) or quadratic fields, at walls too (default: quadratic)")  # fmt: skip
    add("--interpolation", choices=tuple(INTERPOLATIONS), default="splines",
        help="of modes at moving particles: local polyharmonic splines, or polynomials where "
        "particles start on a lattice, which cost less (default: %(default)s)")  # fmt: skip
    add("--spline-order", type=positive_int, default=3, metavar="K",
        help="of the splines or polynomials (default: %(default)s)")  # fmt: skip
    add_closure_options(add, default=None)
    add("--slice", type=float, metavar="X",
        help="compare on the vertical line at x = X [m] (default: the centre line; open-cavity "
        "0.25)")  # fmt: skip
    add("--out", type=Path, metavar="DIR", help="folder for all results (default: out/rom-SCENE)")
    add_json_option(parser)
    # not for it, which compares models over Reynolds numbers: an error tells what is
    add_training_options(parser, words, {"reynolds": {"help": argparse.SUPPRESS}})
    parser.set_defaults(command=_run, inner_product=None)


def memory_length(text: str) -> float | MemoryLength:
    """A memory length [s], or the rule of that name."""
    if text in MEMORIES:
        return MEMORIES[text]
    try:
        return positive_float(text)
    except (ValueError, argparse.ArgumentTypeError):
        raise argparse.ArgumentTypeError(
            f"a time in s, {' or '.join(MEMORIES)}, got {text!r}"
        ) from None


def _run(options) -> int:
    folder = options.out or Path("out", f"rom-{name_of(options.scene, options.make)}")
    report = folder / "report.json"
    check_target(report)
    check_target(folder / "report.html")
    for name, value in (PAPERS if options.faithful else BEST).items():
        if getattr(options, name) is None:
            setattr(options, name, value)
    usual = PLANS.get(options.scene)
    if options.hyper is None:
        options.hyper = ["none"] if usual is None or options.faithful else list(usual.hyper)
        options.closure = options.closure or ("linear" if "tensor" in options.hyper else "none")
    options.closure = options.closure or "none"
    with jax.enable_x64(options.precision == "float64"):
        plan = _plan(options)
        experiments = plan.experiments()
        study = _study(options, plan, folder)
        try:
            outcomes = list(study.run(*experiments))
        except SimulationError as error:
            return fail("jaxsph-rom", f"full model: {error}", 1)
        except KeyboardInterrupt:
            return fail("jaxsph-rom", "interrupted; the same command goes on from here.", 130)
        write_config(folder / NAME, options)
        write_study(study, experiments, outcomes, folder, command=repeating(options))
    if options.json is not None:
        write_json(options.json, json.loads(report.read_text()))
    print(format_table([outcome.case for outcome in outcomes]))
    if plan.judged_from:
        print(f"peaks and medians are taken from t = {plan.judged_from:g} s on")
    _print_verdict([outcome.case for outcome in outcomes], folder, plan)
    print(f"\nreport: {folder / 'report.html'}, {report}\nfigures: {folder}/*.png")
    _print_disk(folder)
    return 0


def _print_verdict(cases: list[Case], folder: Path, plan: Plan) -> None:
    """What the table comes to, and how to use the model that it speaks for."""
    for text in verdict(cases):
        whole = text.replace(" %", "\N{NO-BREAK SPACE}%")
        print("\n" + textwrap.fill(whole, WIDTH).replace("\N{NO-BREAK SPACE}", " "))
    if (folder / MODEL).exists():
        told = best([case for case in cases if case.hyper != "none"])[0]
        print(f"\n{folder / MODEL} is the model on points with M = {told.modes}; run it by\n"
              f"  jaxsph-rom predict {folder / MODEL} --reynolds {plan.predict[0]:g}")  # fmt: skip
    elif not any(case.time_ratio is not None and case.time_ratio > 1.0 for case in cases):
        print("\nModels on points are the fast ones: add --hyper tensor.")


def _print_disk(folder: Path) -> None:
    """What the folder takes, and what of it only spares running again."""
    kept = [bytes_in(folder / name) for name in ("full", "reduced")]
    print(f"disk: {bytes_told(bytes_in(folder))} in {folder}, {bytes_told(sum(kept))} of it runs "
          "that are kept: the same command goes on from them")  # fmt: skip


def _plan(options) -> Plan:
    given = {
        name: distinct(getattr(options, name))
        for name in ("predict", "modes", "borders")
        if getattr(options, name) is not None
    }
    for name, option in (("slice_at", "slice"), ("settling", "settling")):
        if getattr(options, option) is not None:
            given[name] = getattr(options, option)
    values = trained_at(options)
    if values is not None:
        if set(values) != {"reynolds"}:
            raise ValueError("--train: models are compared over Reynolds numbers; of other "
                             "parameters make one by jaxsph-rom train.")  # fmt: skip
        given["train"] = values["reynolds"]
    if {"train", "predict"} & set(given) and "borders" not in given:
        given["borders"] = None  # the plan's borders belong to its own Reynolds numbers
    return planned(options, ("train", "predict", "modes"), given)


def _study(options, plan: Plan, folder: Path) -> Study:
    closed = options.closure == "linear"
    if closed and "tensor" not in options.hyper:
        raise ValueError("--closure: models on moving particles have none; add --hyper tensor.")
    check_closure(options)
    moving, experiments = _on_particles(options, plan), plan.experiments()
    on_points, on_particles = "tensor" in options.hyper, "none" in options.hyper
    fixed = OnPoints(formulation(options), moving.product, closed, options.held_back)
    for experiment in experiments if on_points else ():
        fixed.closure(experiment)

    def check(scene: Scene) -> None:
        moving.interpolation.check(scene.state.position, scene.space, options.spline_order)
        if on_particles:
            check_still(scene)
            moving.advection.eulerian(scene.effects)

    def trained(family: Family) -> None:
        for experiment in experiments if on_points else ():
            check_family(family, [{"reynolds": re} for re in experiment.trained_on])

    points = [{"reynolds": number} for number in (*plan.train, *plan.predict)]
    family = scene_maker(options, plan, points, folder, on_points, check, trained)
    methods = {"none": moving, "tensor": replace(fixed, family=family)}
    return Study(
        lambda reynolds: family.make(reynolds=reynolds),
        folder,
        *(methods[name] for name in methods if name in options.hyper),
        progress=bar,
        probes=plan.probes,
        judged_from=plan.judged_from,
    )


def _on_particles(options, plan: Plan) -> OnParticles:
    memory = plan.tau if options.tau is None else options.tau
    if not isinstance(memory, MemoryLength):
        memory = AdjointPetrovGalerkin(jax.numpy.asarray(memory, options.precision))
    projections = {"galerkin": Galerkin(), "apg": memory}
    advection = ADVECTIONS[options.advection]()
    return OnParticles(
        tuple(projections[name] for name in distinct(options.projection)),
        PRODUCTS[options.inner_product](),
        Gauged(advection) if options.gauge else advection,
        MAPS[options.map],
        INTERPOLATIONS[options.interpolation],
        options.spline_order,
    )
