"""Memory lengths of the adjoint Petrov-Galerkin projection: fixed, or found from a Jacobian.

    python -m benchmarks.memory_length

The Taylor-Green vortex at Re 100, reconstructed on moving particles as in `benchmarks.paper_rom`,
in the paper's inner product and in that of energy. Galerkin projection stands beside the paper's
fixed memory length and C / |lambda_max| of the projected Jacobian, once of all of it and once of
its convective part, at several C. Runs are kept in a folder and finished cases in the JSON file:
the same command goes on.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import jax

from jaxsph.cli import positive_float, positive_int
from jaxsph.environment import environment
from jaxsph.scenes import taylor_green
from jaxsph.schemes import DeltaPlus
from jaxsph_rom import (
    FAITHFUL,
    AdjointPetrovGalerkin,
    ConvectiveMemory,
    Experiment,
    Galerkin,
    SpectralMemory,
    Study,
)
from jaxsph_rom.cli import PRODUCTS
from jaxsph_rom.study import PLANS

from .measure import format_rows, number, progress, tell
from .table import Table, command

REYNOLDS = 100.0
CONSTANTS = (0.2, 0.02, 0.002)
KEY = ("inner_product", "modes", "rule")


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: a full run failed, 2: bad input."""
    return command(
        "memory_length", __doc__, _arguments, _run, argv, json="memory_length_{resolution}.json"
    )


def _arguments(add) -> None:
    add("--resolution", type=positive_int, default=32, metavar="N",
        help="particles per side (default: %(default)s)")  # fmt: skip
    add("--end-time", type=positive_float, default=1.0, metavar="T", help="[s] (default: 1)")
    add("--modes", type=positive_int, nargs="+", default=[5, 10], metavar="M",
        help="numbers of modes (default: 5 10)")  # fmt: skip
    add("--constants", type=positive_float, nargs="+", default=list(CONSTANTS), metavar="C",
        help="of both rules (default: 0.2 0.02 0.002)")  # fmt: skip
    add("--inner-product", choices=tuple(PRODUCTS), nargs="+", default=list(PRODUCTS),
        help="of POD and projection (default: both)")  # fmt: skip
    add("--out", type=Path, metavar="DIR",
        help="where runs are kept (default: out/memory-length)")  # fmt: skip


def _rules(constants) -> dict[str, Any]:
    """Projections and rules, by the name under which a case is kept."""
    fixed = PLANS["taylor-green"].tau
    rules = {"galerkin": Galerkin(), "fixed": AdjointPetrovGalerkin(fixed)}
    for constant in constants:
        for rule in (SpectralMemory(constant), ConvectiveMemory(constant)):
            rules[rule.label] = rule
    return rules


def _run(options) -> None:
    settings = {"resolution": options.resolution, "end_time": options.end_time}
    kept = Table(options.json, KEY, settings=settings, rows="cases")
    rules = _rules(options.constants)

    def make(reynolds):
        return taylor_green(
            options.resolution, reynolds, end_time=options.end_time, scheme=DeltaPlus(),
            dtype="float64",
        )

    for product in options.inner_product:
        for modes in options.modes:
            left = [name for name in rules if not kept.has((product, modes, name))]
            if not left:
                tell(f"done before: {product}, M = {modes}")
                continue
            projections = tuple(rules[name] for name in left)
            method = replace(FAITHFUL, projections=projections, product=PRODUCTS[product]())
            folder = options.out or Path("out", "memory-length")
            study = Study(make, folder, method, progress=progress)
            experiment = Experiment((REYNOLDS,), (REYNOLDS,), (modes,))
            for name, outcome in zip(left, study.run(experiment), strict=True):
                kept.rows.append(outcome.case.to_dict() | {"rule": name})
                kept.rows.sort(key=lambda case: (case["inner_product"], case["modes"]))
                kept.results |= {
                    "particles": outcome.trajectory.particles,
                    "parameters": study.runs.scene(REYNOLDS).parameters,
                    "step": study.runs.scene(REYNOLDS).time_step,
                    "device": jax.devices()[0].device_kind,
                    "environment": environment(),
                }
                kept.write()
    print(_table(kept.results))


def _table(results: dict[str, Any]) -> str:
    header = ("product", "M", "rule", "tau s", "tau / dt", "velocity %", "median", "pressure %",
              "median", "reduced s", "stable")  # fmt: skip
    rows = []
    for case in results["cases"]:
        tau = case["tau"]
        rows.append((
            case["inner_product"], str(case["modes"]), case["rule"], number(tau),
            number(None if tau is None else tau / results["step"]),
            *(number(case[name]) for name in (
                "velocity_peak_percent", "velocity_median_percent", "pressure_peak_percent",
                "pressure_median_percent", "rom_seconds")),
            "yes" if case["stable"] else f"to {number(case['fault_time'])} s",
        ))  # fmt: skip
    text = f"discrepancy on the centre line, {results['particles']} particles\n"
    return text + format_rows(header, rows)


if __name__ == "__main__":
    raise SystemExit(main())
