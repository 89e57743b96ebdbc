"""The source paper's reduced models, its printed errors beside ours.

    python -m benchmarks.paper_rom taylor-green --scale half

Its three experiments with its options: Galerkin (its GPOD) and adjoint Petrov-Galerkin projection
with its memory length, its advection, Euclidean inner product, no centring. What is run is listed
in `references/source_paper.py`. With `--points` models on points, whose online cost is that of
tensors, learn from the same full runs. Runs are kept in a folder and finished cases in the JSON
file, so that all can be made in parts: the same command goes on.
"""

from __future__ import annotations

import dataclasses
import inspect
from fnmatch import fnmatch
from functools import partial
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxsph.cli import (
    ARRANGEMENTS,
    SCALES,
    positive_float,
    positive_int,
)
from jaxsph.environment import environment
from jaxsph.scenes import SCENES
from jaxsph.schemes import DeltaPlus
from jaxsph_rom import (
    FAITHFUL,
    AdjointPetrovGalerkin,
    Experiment,
    Galerkin,
    Study,
    cumulative_energy,
)
from jaxsph_rom.cli import PRODUCTS
from jaxsph_rom.study import PLANS, Method, OnPoints, Outcome, Plan

from .measure import (
    Clocked,
    format_rows,
    interacting_pairs,
    number,
    summary,
    tell,
)
from .references.source_paper import EXPERIMENTS, PROJECTIONS, Kind, PaperExperiment, Wanted
from .table import Table, command

POINTS = ("points",)  # stands for the projection of models that are not the paper's
_KEY = ("kind", "reynolds", "modes", "projection", "inner_product")


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: a full run failed, 2: bad input."""
    return command("paper_rom", __doc__, _arguments, _run, argv, json="{scene}_{scale}.json")


def _run(options) -> None:
    paper = EXPERIMENTS[options.scene]
    kinds = _kinds(paper, options)
    wanted = _wanted(paper.wanted(kinds, POINTS if options.points else PROJECTIONS), options)
    kept = Table(options.json, _KEY, settings=_settings(options), rows="cases")
    kept.results.setdefault("cumulative_energy_percent", {})
    if any(case["scene"] != options.scene for case in kept.rows):
        raise ValueError(f"{options.json}: is of another scene; name another file with --json.")
    for name, kind in kinds.items():
        here = [case for case in wanted if case.kind == name]
        if here:
            _run_kind(kept, options, kind, here)
    print(_table(kept.results))


def _arguments(add) -> None:
    add("scene", choices=tuple(EXPERIMENTS), metavar="SCENE",
        help=f"one of {', '.join(EXPERIMENTS)}")  # fmt: skip
    add("--scale", choices=SCALES, default="small", help="size of the runs (default: small)")
    add("--predict", type=positive_float, nargs="+", metavar="RE",
        help="Reynolds numbers to predict instead of the paper's")  # fmt: skip
    add("--modes", type=positive_int, nargs="+", metavar="M",
        help="numbers of modes instead of the paper's")  # fmt: skip
    add("--cases", nargs="+", default=["*"], metavar="PATTERN",
        help="of these, cases KIND-RE-M-PROJECTION that match, for example 'predictive-175-*' "
        "(default: all)")  # fmt: skip
    add("--inner-product", choices=tuple(PRODUCTS), default="euclidean",
        help="of POD and projection (default: %(default)s, the paper's)")  # fmt: skip
    add("--points", action="store_true", help="models on points instead, with the energy product")
    add("--out", type=Path, metavar="DIR",
        help="where runs are kept (default: out/paper-rom-SCENE-SCALE)")  # fmt: skip
    add("--resolution", type=positive_int, metavar="N", help="instead of the scale's")
    add("--h-over-dx", type=positive_float, metavar="X", help="instead of the scale's")
    add("--end-time", type=positive_float, metavar="T", help="[s], instead of the scene's")
    add("--settling", type=positive_float, metavar="T", help="[s], instead of the scene's")
    add("--arrangement", choices=tuple(ARRANGEMENTS),
        help="how particles start (default: packed; in cavities the lattice)")  # fmt: skip


def _kinds(paper: PaperExperiment, options) -> dict[str, Kind]:
    """What is run at this scale, changed as asked."""
    kinds = paper.at_scale.get(options.scale, paper.kinds)
    changed = {}
    for name, kind in kinds.items():
        if options.modes:
            kind = dataclasses.replace(kind, modes=tuple(dict.fromkeys(options.modes)))
        if options.predict and name == "predictive":
            kind = dataclasses.replace(kind, reynolds=tuple(dict.fromkeys(options.predict)))
        changed[name] = kind
    return changed


def _wanted(asked: list[Wanted], options) -> list[Wanted]:
    """The cases asked for.

    Raises:
        ValueError: if there are none.
    """
    chosen = [case for case in asked if any(fnmatch(case.name, p) for p in options.cases)]
    if not chosen:
        names = ", ".join(case.name for case in asked)
        raise ValueError(f"--cases: none matches; choose from {names}.")
    return chosen


def _settings(options) -> dict[str, Any]:
    """What must not change between the parts of one file."""
    end_time = inspect.signature(SCENES[options.scene]).parameters["end_time"].default
    plan = PLANS[options.scene]
    settings = {
        "scale": options.scale,
        "resolution": options.resolution,
        "h_over_dx": options.h_over_dx,
        "end_time": options.end_time or end_time,
        "arrangement": options.arrangement or EXPERIMENTS[options.scene].arrangement,
        "advection": FAITHFUL.advection.name,
        "tau": plan.tau,
    }
    if plan.settling is not None:
        settings["settling"] = options.settling or plan.settling
    return settings


def _run_kind(kept: Table, options, kind: Kind, wanted: list[Wanted]) -> None:
    """Run what is not done yet of one kind, and write the file after each case."""
    name, product = wanted[0].kind, "energy" if options.points else options.inner_product
    keys = {
        case: (case.kind, case.reynolds, case.modes, case.projection, product) for case in wanted
    }
    left = [case for case in wanted if not kept.has(keys[case])]
    for case in wanted:
        if case not in left:
            tell(f"done before: {case.name}")
    energy = kept.results["cumulative_energy_percent"]
    listed = name == "reconstructive" and not options.points and product not in energy
    if not left and not listed:
        return
    clocked = Clocked()
    plan = dataclasses.replace(PLANS[options.scene], borders=kind.borders)
    study = _study(options, plan, clocked, _faithful(options))
    kept.results |= _scene_record(study, kind.trained_on[0]) | {"environment": environment()}
    for reynolds, modes, projections in _products(left):
        wanted = (_projection(projection, plan.tau) for projection in projections)
        method = OnPoints() if options.points else _faithful(options, *wanted)
        study = _study(options, plan, clocked, method)
        asked = dataclasses.replace(plan, train=kind.trained_on, predict=reynolds, modes=modes)
        for experiment in asked.experiments():
            for outcome in study.run(experiment):
                case = _record(options.scene, name, outcome, clocked.take())
                if options.points:
                    case["projection"] = "points"
                kept.rows.append(case)
                kept.rows.sort(key=_place)
                kept.write()
                tell(f"written: {Wanted(name, *(case[key] for key in _KEY[1:4])).name}")
    if listed:
        paper = EXPERIMENTS[options.scene].energy
        experiment = Experiment(kind.trained_on, (), ())
        energy[product] = _energies(study, experiment, paper)
        kept.write()


def _place(case: dict[str, Any]) -> tuple:
    """Where a case stands in the table."""
    kinds = list(EXPERIMENTS[case["scene"]].kinds)
    kind = kinds.index(case["kind"])
    projection = (*PROJECTIONS, *POINTS).index(case["projection"])
    return case["inner_product"], kind, case["reynolds"], case["modes"], projection


def _faithful(options, *projections) -> Method:
    product = PRODUCTS[options.inner_product]()
    return dataclasses.replace(FAITHFUL, projections=projections, product=product)


def _study(options, plan: Plan, clocked: Clocked, method: Method) -> Study:
    folder = options.out or Path("out", f"paper-rom-{options.scene}-{options.scale}")
    settings = _settings(options)
    make = partial(
        SCENES[options.scene],
        scale=options.scale,
        resolution=options.resolution,
        h_over_dx=options.h_over_dx,
        end_time=settings["end_time"],
        arrangement=ARRANGEMENTS[settings["arrangement"]](seed=0),
        scheme=DeltaPlus(),
        dtype="float64",
    )
    plan = dataclasses.replace(plan, settling=settings.get("settling"))
    scene = plan.scenes(make, folder, clocked.progress)
    return Study(
        lambda reynolds: scene(reynolds=reynolds),
        folder,
        method,
        progress=clocked.progress,
        probes=plan.probes,
        judged_from=plan.judged_from,
    )


def _projection(name: str, tau: float):
    return Galerkin() if name == "galerkin" else AdjointPetrovGalerkin(jnp.asarray(tau))


def _products(cases: list[Wanted]):
    """Reynolds numbers, modes and projections whose products are just these cases."""
    by_run: dict[tuple, list] = {}
    for case in cases:
        by_run.setdefault((case.projection, case.reynolds), []).append(case.modes)
    by_modes: dict[tuple, list] = {}
    for (projection, reynolds), modes in by_run.items():
        by_modes.setdefault((projection, tuple(modes)), []).append(reynolds)
    by_both: dict[tuple, list] = {}
    for (projection, modes), reynolds in by_modes.items():
        by_both.setdefault((tuple(reynolds), modes), []).append(projection)
    for (reynolds, modes), projections in by_both.items():
        yield reynolds, modes, projections


def _record(
    scene: str, kind: str, outcome: Outcome, seconds_per_step: list[float]
) -> dict[str, Any]:
    case = outcome.case
    key = (kind, case.reynolds, case.modes, case.projection)
    printed = EXPERIMENTS[scene].printed.get(key)
    return case.to_dict() | {
        "kind": kind,
        "velocity_peak_percent_from_start": float(np.max(outcome.velocity_percent)),
        "pressure_peak_percent_from_start": float(np.max(outcome.pressure_percent)),
        "paper_velocity_peak_percent": printed and printed.velocity,
        "paper_pressure_peak_percent": printed and printed.pressure,
        "paper_note": printed and printed.note,
        "time_ratio": case.time_ratio,
        "rom_seconds_per_step": summary(seconds_per_step),
        "environment": environment(),
    }


def _scene_record(study: Study, reynolds: float) -> dict[str, Any]:
    scene = study.runs.scene(reynolds)
    particles = scene.state.position.shape[0]
    return {
        "particles": particles,
        "neighbors": interacting_pairs(scene.state.position, scene.space) / particles,
        "dtype": str(scene.state.position.dtype),
        "device": jax.devices()[0].device_kind,
        "parameters": scene.parameters,
    }


def _energies(
    study: Study, experiment: Experiment, paper: dict[str, dict[str, float]]
) -> dict[str, Any]:
    """Cumulative energy [%] at the paper's numbers of modes, in its spaces, and the paper's."""
    (method,), trained_on = study.methods, experiment.trained_on
    bases = {
        "lagrangian": study.runs.lagrangian_basis(trained_on, method.product, modes=1),
        "reference": method.basis(study.runs, experiment, 1),
    }
    found: dict[str, Any] = {}
    for space, listed in paper.items():
        energy = np.asarray(cumulative_energy(bases[space].singular_values))
        found[space] = {m: float(energy[int(m) - 1]) for m in listed if int(m) <= len(energy)}
    return found | {"paper": paper}


def _table(results: dict[str, Any]) -> str:
    header = ("Re", "kind", "product", "M", "projection", "velocity %", "paper", "pressure %",
              "paper", "full s", "reduced s", "stable")  # fmt: skip
    rows = []
    for case in results["cases"]:
        unstable = case["paper_note"] is not None and "unstable" in case["paper_note"]
        below = "<" if case["paper_note"] in ("pressure below 10", "at most") else ""
        paper = below + number(case["paper_pressure_peak_percent"])
        rows.append((
            f"{case['reynolds']:g}",
            case["kind"],
            case["inner_product"],
            str(case["modes"]),
            case["projection"],
            number(case["velocity_peak_percent"]),
            number(case["paper_velocity_peak_percent"]),
            number(case["pressure_peak_percent"]),
            "unstable" if unstable else paper,
            number(case["fom_seconds"]),
            number(case["rom_seconds"]),
            "yes" if case["stable"] else f"to {number(case['fault_time'])} s",
        ))  # fmt: skip
    text = f"peak discrepancy on the centre line, {results['particles']} particles\n"
    text += format_rows(header, rows)
    for inner_product, energy in results["cumulative_energy_percent"].items():
        text += f"\n\ncumulative energy [%], reconstructive, {inner_product} inner product\n"
        rows = [
            (space, m, number(energy[space].get(m), 6), number(printed, 6))
            for space, listed in energy["paper"].items()
            for m, printed in listed.items()
        ]
        text += format_rows(("space", "M", "energy", "paper"), rows)
    return text


if __name__ == "__main__":
    raise SystemExit(main())
