"""What each of the source paper's options does to the reduced lid-driven cavity.

    python -m benchmarks.cavity_options

Reduced models on moving particles at Re 100, trained on the same run: inner product, advection and
map are the paper's or this project's, in all combinations. How long each stays good, and its errors
until then. Full and reduced runs are kept in a folder, the full one that of `benchmarks.paper_rom`
if it has made it: the same command goes on.
"""

from __future__ import annotations

from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import jax
import numpy as np

from jaxsph.cli import positive_float, positive_int
from jaxsph.environment import environment
from jaxsph.interpolation import MovingLeastSquaresMap, ShepardMap
from jaxsph.scenes import lid_driven_cavity
from jaxsph.schemes import DeltaPlus
from jaxsph_rom import (
    ConsistentAdvection,
    Energy,
    Euclidean,
    Experiment,
    OnParticles,
    PaperAdvection,
    Study,
)
from jaxsph_rom.study import PLANS, Outcome

from .measure import Clocked, format_rows, number, summary, write_json
from .table import command

REYNOLDS = 100.0
CHOICES = tuple(product(
    (Euclidean(), Energy()),
    (PaperAdvection(), ConsistentAdvection()),
    (ShepardMap, MovingLeastSquaresMap),
))  # fmt: skip


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: the full run failed, 2: bad input."""
    return command("cavity_options", __doc__, _arguments, _run, argv)


def _run(options) -> None:
    results = {"rows": list(_rows(options)), "environment": environment()}
    write_json(options.json, results)
    print(_table(results["rows"]))


def _arguments(add) -> None:
    add("--resolution", type=positive_int, metavar="N", help="instead of the small scale's")
    add("--end-time", type=positive_float, default=10.0, metavar="T", help="[s] (default: 10)")
    add("--modes", type=positive_int, default=10, metavar="M", help="default: %(default)s")
    add("--out", type=Path, default=Path("out/paper-rom-lid-driven-cavity-small"), metavar="DIR",
        help="where runs are kept (default: %(default)s)")  # fmt: skip


def _rows(options):
    plan = PLANS["lid-driven-cavity"]
    make = partial(
        lid_driven_cavity, options.resolution, end_time=options.end_time, scheme=DeltaPlus(),
        dtype="float64",
    )
    clocked = Clocked()
    for inner_product, advection, rule in CHOICES:
        study = Study(
            lambda reynolds: make(reynolds=reynolds),
            options.out,
            OnParticles(product=inner_product, advection=advection, rule=rule),
            progress=clocked.progress,
            probes=plan.probes,
        )
        experiment = Experiment((REYNOLDS,), (REYNOLDS,), (options.modes,))
        (outcome,) = study.run(experiment)
        yield {
            "inner_product": type(inner_product).__name__,
            "advection": advection.name,
            "map": rule.__name__,
            **_figures(outcome),
            "rom_seconds_per_step": summary(clocked.take())["median"],
            "device": jax.devices()[0].device_kind,
        }


def _figures(outcome: Outcome) -> dict[str, Any]:
    """Errors over the time that the run stayed good; `lasted` is that time."""
    case = outcome.case
    return {
        "modes": case.modes,
        "lasted": case.fault_time if case.fault_time is not None else float(outcome.time[-1]),
        "fault": case.fault,
        **{
            f"{name}_{what}_percent": float(of(percent[1:]))
            for name, percent in (
                ("velocity", outcome.velocity_percent), ("pressure", outcome.pressure_percent)
            )
            for what, of in (("peak", np.max), ("median", np.median))
        },
        "fom_seconds": case.fom_seconds,
    }  # fmt: skip


def _table(rows: list[dict[str, Any]]) -> str:
    header = ("product", "advection", "map", "lasted s", "velocity %", "median", "pressure %",
              "median", "s per step")  # fmt: skip
    cells = [
        (
            row["inner_product"], row["advection"], row["map"], number(row["lasted"]),
            *(number(row[f"{name}_percent"]) for name in (
                "velocity_peak", "velocity_median", "pressure_peak", "pressure_median")),
            number(row["rom_seconds_per_step"]),
        )
        for row in rows
    ]  # fmt: skip
    return "on the centre line, Re 100\n" + format_rows(header, cells)


if __name__ == "__main__":
    raise SystemExit(main())
