"""The reduced models of the paper's first experiment, its printed errors beside ours.

    python -m benchmarks.taylor_green_rom --scale half

Re 100 reconstructed with M = 5 and 10 modes, and Re 125, 175 and 225 predicted with M = 5 from runs
at Re 100, 150, 200 and 250; Galerkin (the paper's GPOD) and adjoint Petrov-Galerkin projection
with tau = 1e-4 s, the paper's advection and Euclidean inner product. Runs are kept in a folder and
finished cases in the JSON file, so that all can be made in parts: the same command goes on.
"""

from __future__ import annotations

import argparse
import time as clock
from contextlib import contextmanager
from dataclasses import dataclass
from fnmatch import fnmatch
from itertools import product
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxsph import SimulationError
from jaxsph.cli import (
    ARRANGEMENTS,
    SCALES,
    fail,
    positive_float,
    positive_int,
    report_errors,
)
from jaxsph.environment import environment
from jaxsph.io import check_target
from jaxsph.scenes import taylor_green
from jaxsph_rom import (
    AdjointPetrovGalerkin,
    Experiment,
    Galerkin,
    PaperAdvection,
    Study,
    cumulative_energy,
)
from jaxsph_rom.cli import PRODUCTS
from jaxsph_rom.report import Case

from .measure import (
    format_rows,
    interacting_pairs,
    number,
    progress,
    read_json,
    summary,
    tell,
    write_json,
)

TAU = 1e-4  # s, the paper's
PROJECTIONS = ("galerkin", "apg")
TRAINED_ON = {"reconstructive": (100.0,), "predictive": (100.0, 150.0, 200.0, 250.0)}
PREDICTED = {
    "small": (125.0, 175.0, 225.0),
    "half": (175.0,),
    "paper": (125.0, 175.0, 225.0),
}
MODES = {"reconstructive": (5, 10), "predictive": (5,)}

# Peak discrepancy [%] of velocity and of pressure that the paper prints, and how it says so where
# a number alone would mislead: (kind, Re, M, projection).
PAPER = {
    ("reconstructive", 100.0, 5, "galerkin"): (10.0, 6.0, None),
    ("reconstructive", 100.0, 5, "apg"): (10.0, 4.0, None),
    ("reconstructive", 100.0, 10, "galerkin"): (8.0, None, "velocity 7 to 8, pressure unstable"),
    ("reconstructive", 100.0, 10, "apg"): (8.0, 50.0, "velocity 7 to 8"),
    ("predictive", 125.0, 5, "galerkin"): (10.0, 30.0, None),
    ("predictive", 125.0, 5, "apg"): (10.0, 10.0, "pressure below 10"),
    ("predictive", 175.0, 5, "galerkin"): (4.0, 20.0, None),
    ("predictive", 175.0, 5, "apg"): (4.0, 10.0, "pressure below 10"),
    ("predictive", 225.0, 5, "galerkin"): (8.0, 20.0, None),
    ("predictive", 225.0, 5, "apg"): (8.0, 10.0, "pressure below 10"),
}
# cumulative energy [%] of M modes at Re 100
PAPER_ENERGY = {
    "lagrangian": {"2": 99.9, "5": 99.98, "10": 99.995},
    "reference": {"2": 99.996, "5": 99.999, "10": 99.9994},
}
_KEY = ("kind", "reynolds", "modes", "projection", "inner_product")


@dataclass(frozen=True)
class Wanted:
    """A case to be run."""

    kind: str
    reynolds: float
    modes: int
    projection: str

    @property
    def name(self) -> str:
        """As `--cases` takes it."""
        return f"{self.kind}-{self.reynolds:g}-{self.modes}-{self.projection}"


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: a full run failed, 2: bad input."""
    return report_errors("taylor_green_rom", _command, argv)


def _command(argv) -> int:
    options = _parser().parse_args(argv)
    path = options.json or Path("benchmarks", "results", f"taylor_green_{options.scale}.json")
    check_target(path)
    wanted = _wanted(options)
    with jax.enable_x64(True):
        results = _started(path, options)
        try:
            for kind in TRAINED_ON:
                here = [case for case in wanted if case.kind == kind]
                if here:
                    _run(path, results, options, kind, here)
        except SimulationError as error:
            return fail("taylor_green_rom", f"full model: {error}", 1)
    print(_table(results))
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        "python -m benchmarks.taylor_green_rom", description=__doc__.splitlines()[0]
    )
    add = parser.add_argument
    add("--scale", choices=SCALES, default="small", help="size of the runs (default: small)")
    add("--only", choices=tuple(TRAINED_ON), help="one kind of case (default: both)")
    add("--predict", type=positive_float, nargs="+", metavar="RE",
        help="Reynolds numbers to predict (default: 125 175 225; at scale half 175)")  # fmt: skip
    add("--modes", type=positive_int, nargs="+", metavar="M",
        help="numbers of modes (default: 5 10 reconstructive, 5 predictive)")  # fmt: skip
    add("--projection", choices=PROJECTIONS, nargs="+", default=list(PROJECTIONS),
        help="default: both")  # fmt: skip
    add("--cases", nargs="+", default=["*"], metavar="PATTERN",
        help="of these, cases KIND-RE-M-PROJECTION that match, for example 'predictive-175-*' "
        "(default: all)")  # fmt: skip
    add("--inner-product", choices=tuple(PRODUCTS), default="euclidean",
        help="of POD and projection (default: %(default)s, the paper's)")  # fmt: skip
    add("--out", type=Path, metavar="DIR",
        help="where runs are kept (default: out/taylor-green-rom-SCALE)")  # fmt: skip
    add("--json", type=Path, metavar="FILE",
        help="default: benchmarks/results/taylor_green_SCALE.json")  # fmt: skip
    add("--resolution", type=positive_int, metavar="N", help="instead of the scale's")
    add("--h-over-dx", type=positive_float, metavar="X", help="instead of the scale's")
    add("--end-time", type=positive_float, default=1.0, metavar="T", help="[s] (default: 1)")
    add("--arrangement", choices=tuple(ARRANGEMENTS), default="packed",
        help="how particles start (default: %(default)s)")  # fmt: skip
    return parser


def _wanted(options) -> list[Wanted]:
    """The cases asked for.

    Raises:
        ValueError: if there are none.
    """
    asked = []
    for kind in TRAINED_ON if options.only is None else (options.only,):
        predicted = options.predict or PREDICTED[options.scale]
        reynolds = TRAINED_ON[kind] if kind == "reconstructive" else predicted
        for values in product(reynolds, options.modes or MODES[kind], options.projection):
            asked.append(Wanted(kind, *values))
    asked = list(dict.fromkeys(asked))
    chosen = [case for case in asked if any(fnmatch(case.name, p) for p in options.cases)]
    if not chosen:
        names = ", ".join(case.name for case in asked)
        raise ValueError(f"--cases: none matches; choose from {names}.")
    return chosen


def _settings(options) -> dict[str, Any]:
    """What must not change between the parts of one file."""
    return {
        "scale": options.scale,
        "resolution": options.resolution,
        "h_over_dx": options.h_over_dx,
        "end_time": options.end_time,
        "arrangement": options.arrangement,
        "advection": PaperAdvection().name,
        "tau": TAU,
    }


def _started(path: Path, options) -> dict[str, Any]:
    """The results so far.

    Raises:
        ValueError: if the file holds results of other settings.
    """
    fresh = {"settings": _settings(options), "cases": [], "cumulative_energy_percent": {}}
    found = read_json(path)
    if found is None:
        return fresh
    if found.get("settings") != fresh["settings"]:
        raise ValueError(f"{path}: was made with other settings; name another file with --json.")
    return found


def _run(path: Path, results, options, kind: str, wanted: list[Wanted]) -> None:
    """Run what is not done yet of one kind, and write the file after each case."""
    done = {tuple(case[name] for name in _KEY) for case in results["cases"]}
    left = []
    for case in wanted:
        key = (case.kind, case.reynolds, case.modes, case.projection, options.inner_product)
        if key in done:
            tell(f"done before: {case.name}")
        else:
            left.append(case)
    energy = results["cumulative_energy_percent"]
    listed = kind == "reconstructive" and options.inner_product not in energy
    if not left and not listed:
        return
    clocked = _Clocked()
    study = _study(options, clocked)
    results |= _scene_record(study, TRAINED_ON[kind][0]) | {"environment": environment()}
    for reynolds, modes, projections in _products(left):
        study.projections = tuple(_projection(name) for name in projections)
        experiment = Experiment(TRAINED_ON[kind], reynolds, modes)
        for outcome in study.run(experiment):
            case = _record(kind, outcome.case, clocked.take())
            results["cases"].append(case)
            results["cases"].sort(key=_place)
            write_json(path, results)
            tell(f"written: {Wanted(kind, *(case[name] for name in _KEY[1:4])).name}")
    if listed:
        energy[options.inner_product] = _energies(study, Experiment(TRAINED_ON[kind], (), ()))
        write_json(path, results)


def _place(case: dict[str, Any]) -> tuple:
    """Where a case stands in the table."""
    kind, projection = list(TRAINED_ON).index(case["kind"]), PROJECTIONS.index(case["projection"])
    return case["inner_product"], kind, case["reynolds"], case["modes"], projection


def _study(options, clocked: _Clocked) -> Study:
    arrangement = ARRANGEMENTS[options.arrangement](seed=0)

    def make(reynolds):
        return taylor_green(
            options.resolution,
            reynolds,
            scale=options.scale,
            h_over_dx=options.h_over_dx,
            end_time=options.end_time,
            arrangement=arrangement,
            dtype="float64",
        )

    folder = options.out or Path("out", f"taylor-green-rom-{options.scale}")
    return Study(
        make,
        folder,
        product=PRODUCTS[options.inner_product](),
        advection=PaperAdvection(),
        progress=clocked.progress,
    )


def _projection(name: str):
    return Galerkin() if name == "galerkin" else AdjointPetrovGalerkin(jnp.asarray(TAU))


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


class _Clocked:
    """Progress bars that keep the time per step of the last run (none if it was read from disk)."""

    def __init__(self):
        self.seconds: list[float] = []

    def take(self) -> list[float]:
        """The times since they were last taken."""
        taken, self.seconds = self.seconds, []
        return taken

    @contextmanager
    def progress(self, label, total, done):
        self.seconds = []  # of this run only
        last = None
        with progress(label, total, done) as report:

            def mark(steps):
                nonlocal last
                now = clock.perf_counter()
                if last is not None:  # the first part would count compilation
                    self.seconds.append((now - last) / steps)
                last = now
                report(steps)

            yield mark


def _record(kind: str, case: Case, seconds_per_step: list[float]) -> dict[str, Any]:
    velocity, pressure, note = PAPER.get(
        (kind, case.reynolds, case.modes, case.projection), (None, None, None)
    )
    return case.to_dict() | {
        "kind": kind,
        "paper_velocity_peak_percent": velocity,
        "paper_pressure_peak_percent": pressure,
        "paper_note": note,
        "time_ratio": case.time_ratio,
        "rom_seconds_per_step": summary(seconds_per_step),
        "environment": environment(),
    }


def _scene_record(study: Study, reynolds: float) -> dict[str, Any]:
    scene = study.scene(reynolds)
    particles = scene.state.position.shape[0]
    return {
        "particles": particles,
        "neighbors": interacting_pairs(scene.state.position, scene.space) / particles,
        "dtype": str(scene.state.position.dtype),
        "device": jax.devices()[0].device_kind,
        "parameters": scene.parameters,
    }


def _energies(study: Study, experiment: Experiment) -> dict[str, Any]:
    """Cumulative energy [%] at the paper's numbers of modes, in both spaces, and the paper's."""
    bases = {
        "lagrangian": study.lagrangian_basis(experiment, 1),
        "reference": study.basis(experiment, 1),
    }
    found: dict[str, Any] = {}
    for space, basis in bases.items():
        energy = np.asarray(cumulative_energy(basis.singular_values))
        listed = (m for m in PAPER_ENERGY[space] if int(m) <= len(energy))
        found[space] = {m: float(energy[int(m) - 1]) for m in listed}
    return found | {"paper": PAPER_ENERGY}


def _table(results: dict[str, Any]) -> str:
    header = ("Re", "kind", "product", "M", "projection", "velocity %", "paper", "pressure %",
              "paper", "full s", "reduced s", "stable")  # fmt: skip
    rows = []
    for case in results["cases"]:
        unstable = case["paper_note"] is not None and "unstable" in case["paper_note"]
        below = "<" if case["paper_note"] == "pressure below 10" else ""
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
        text += f"\n\ncumulative energy [%], Re 100, {inner_product} inner product\n"
        columns = [e[space] for space in PAPER_ENERGY for e in (energy, PAPER_ENERGY)]
        text += format_rows(
            ("M", "Lagrangian", "paper", "reference", "paper"),
            [(m, *(number(c.get(m), 6) for c in columns)) for m in PAPER_ENERGY["lagrangian"]],
        )
    return text


if __name__ == "__main__":
    raise SystemExit(main())
