"""`jaxsph-rom advise SCENE`: which setting to use for a wanted accuracy."""

from __future__ import annotations

import argparse
import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

from jaxsph.cli import Parser, print_rows
from jaxsph.cli.options import add_json_option, write_json

from .. import advice
from ..advice import Advice, Row


def add_to(parser: Parser, words: list[str]) -> None:
    """Add the command's options to its parser."""
    parser.description = (
        "Say from measurements that came with the package which full or reduced model "
        "is the cheapest within the errors given, or the most accurate within a time; and how to "
        "run it. Times are of the machine that the answer names. Exit code 1: none is within."
    )
    parser.set_defaults(command=_advise)
    add = parser.add_argument
    add("scene", metavar="SCENE",
        help="that was measured: taylor-green, lid-driven-cavity, poiseuille, couette or "
        "hydrostatic-tank")  # fmt: skip
    add("--velocity-error", type=_read(advice.percent), metavar="E",
        help="relative L2 error of the velocity, largest over time, as 1%%")  # fmt: skip
    add("--pressure-error", type=_read(advice.percent), metavar="E",
        help="that of the pressure, median over time, as 5%%")  # fmt: skip
    add("--time-budget", type=_read(advice.seconds), metavar="T",
        help="that a run may take, as 10s, 200ms or 2min")  # fmt: skip
    add("--table", type=Path, default=advice.TABLE, metavar="FILE",
        help="of measurements (default: the package's own)")  # fmt: skip
    add_json_option(parser)


def _read(rule: Callable[[str], float]) -> Callable[[str], float]:
    """A rule as argparse wants it: its own words in the error."""

    def read(text: str) -> float:
        try:
            return rule(text)
        except ValueError as error:
            raise argparse.ArgumentTypeError(str(error)) from None

    return read


def _advise(options) -> int:
    table = advice.read_table(options.table)
    if options.scene not in table["scenes"]:
        raise ValueError(
            f"scene {options.scene!r} was not measured; there are {', '.join(table['scenes'])}."
        )
    scene = table["scenes"][options.scene]
    wanted = (options.velocity_error, options.pressure_error, options.time_budget)
    found = advice.advise(scene["rows"], *wanted)
    write_json(options.json, _results(found, table))
    if not found.reached:
        print(f"None of {len(scene['rows'])} settings is {_asked(*wanted)}. The best there is:")
    print_rows(_cells(found.best))
    if found.untrained is not None:
        _print_untrained(found)
    print(
        f"\nMeasured at Re = {scene['reynolds']:g} to t = {scene['end_time']:g} s against "
        f"{scene['reference']}:\nvelocity at its worst time, pressure at the median time, both "
        f"relative L2. Times are of\n{_machine(table)}."
    )
    if table.get("grid") == "quick":
        print("The table is that of a quick measurement, of few and coarse settings.")
    print(f"\nRun it by\n{found.best.command}")
    return 0 if found.reached else 1


def _asked(velocity: float | None, pressure: float | None, budget: float | None) -> str:
    parts = [f"within {value:g} % in {name}" for name, value in
             (("velocity", velocity), ("pressure", pressure)) if value is not None]  # fmt: skip
    parts += [] if budget is None else [f"within {budget:g} s"]
    return ", ".join(parts)


def _cells(row: Row) -> dict[str, str]:
    cells = {
        "model": row.family if row.offline_seconds is None else f"reduced, {row.family}",
        "setting": row.label,
        "velocity error": f"{row.velocity_percent:.3g} %",
        "pressure error": f"{row.pressure_percent:.3g} %",
        "run": f"{row.seconds:.3g} s{_compilation(row)}",
    }
    if row.offline_seconds is not None:
        cells["training before"] = f"{row.offline_seconds:.3g} s"
    return cells


def _print_untrained(found: Advice) -> None:
    full, runs = found.untrained, found.paid_back_after
    print("\nThe full model that answers the same, without training:")
    print_rows(_cells(full))
    print_rows({"command": full.command.replace("\n", "; ")})
    if runs is not None:
        print(f"The reduced model's training is paid back after {runs} run{'s' * (runs != 1)}.")


def _compilation(row) -> str:
    """What compiling takes, where that was measured by itself."""
    seconds = row.compile_seconds
    return "" if seconds is None else f", and {seconds:.2g} s to compile"


def _machine(table: dict[str, Any]) -> str:
    machine = table["machine"]
    return (
        f"{machine['processor']}, cores used: {machine['cores']}, {machine['system']}, "
        f"jaxsph {table['versions']['jaxsph']}, jax {table['versions']['jax']}"
    )


def _results(found: Advice, table: dict[str, Any]) -> dict[str, Any]:
    return {
        **dataclasses.asdict(found),
        "paid_back_after": found.paid_back_after,
        "machine": table["machine"],
        "versions": table["versions"],
    }
