"""Peers side by side: this full model, PySPH and JAX-SPH, in one run and in turns.

    python -m benchmarks.peers --pysph-python ENV/bin/python --jax-sph FOLDER \\
        --jax-sph-python ENV/bin/python

The two-dimensional Taylor-Green vortex in the periodic unit square, double precision, Wendland C2
kernel, the same particles and smoothing length in all codes, all cores. First the time of a
right-hand side with neighbours at hand, a time of its own for finding them, and both again as the
processor time of all threads, which other work on the machine blurs less; then whole runs, error
against time. Three schemes: plain physics that all can do (whose rates are compared as well, as
proof that it is the same physics), each code's richest one, and the peers' transport velocity.
Every figure is written beside the terms that it stands for. Peers that are not there are named with
the reason. `python -m benchmarks.peers.setup` makes the peers' environments.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from jaxsph.cli import positive_float, positive_int
from jaxsph.environment import environment

from ..measure import format_rows, number, tell, write_json
from ..table import command
from .accuracy import accuracy_rows, at_equal_time
from .protocol import SCHEMES
from .speed import speed_row
from .workers import OURS, cores, find_codes


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 2: bad input."""
    return command("peers", __doc__, _arguments, _run, argv)


def _arguments(add) -> None:
    add("--resolution", type=positive_int, nargs="+", default=[100], metavar="N",
        help="particles per side where right-hand sides are timed (default: 100)")  # fmt: skip
    add("--h-over-dx", type=positive_float, nargs="+", default=[2.0, 4.0], metavar="X",
        help="smoothing length over spacing; runs take the first (default: 2 4)")  # fmt: skip
    add("--scheme", choices=SCHEMES, nargs="+", default=list(SCHEMES),
        help="default: all three")  # fmt: skip
    add("--reynolds", type=positive_float, default=100.0, metavar="RE", help="default: 100")
    add("--repeats", type=positive_int, default=15, metavar="K",
        help="turns of each code (default: %(default)s)")  # fmt: skip
    add("--run-resolution", type=positive_int, nargs="*", default=[32, 48, 64], metavar="N",
        help="of whole runs of all codes; may be empty (default: 32 48 64)")  # fmt: skip
    add("--finer", type=positive_int, nargs="*", default=[96, 128], metavar="N",
        help="of further runs of this library alone, to reach the peers' times "
        "(default: 96 128)")  # fmt: skip
    add(
        "--end-time", type=positive_float, default=1.0, metavar="T", help="of runs [s] (default: 1)"
    )
    add("--jax-sph", type=Path, metavar="PATH", help="folder of JAX-SPH's sources")
    add("--jax-sph-python", type=Path, metavar="PATH",
        help="the Python that has what JAX-SPH needs (default: this one)")  # fmt: skip
    add("--pysph-python", type=Path, metavar="PATH", help="the Python that has PySPH")


def _run(options) -> None:
    """All figures, written after each case."""
    codes, missing = find_codes(options.jax_sph, options.jax_sph_python, options.pysph_python)
    for name, reason in missing.items():
        tell(f"{name} is missing: {reason}")
    results: dict[str, Any] = {
        "missing": missing,
        "schemes": SCHEMES,
        "precision": "float64",
        "kernel": "Wendland C2, support 2 h",
        "reynolds": options.reynolds,
        "end_time": options.end_time,
        "cores": cores(),
        "environment": environment(),
        "xla_flags": os.environ.get("XLA_FLAGS", ""),  # of this library and of JAX-SPH
        "right_hand_sides": [],
        "runs": [],
        "equal_time": [],
    }

    def keep():
        results["load_average"] = os.getloadavg() if hasattr(os, "getloadavg") else None
        write_json(options.json, results)

    for resolution in options.resolution:
        for h_over_dx in options.h_over_dx:
            for scheme in options.scheme:
                tell(f"{scheme}, {resolution} x {resolution}, h = {h_over_dx:g} dx")
                row = speed_row(codes, scheme, resolution, h_over_dx, options)
                results["right_hand_sides"].append(row)
                keep()
    ours = [code for code in codes if code.name == OURS]
    for scheme in options.scheme:
        for resolution in options.run_resolution + options.finer:
            tell(f"{scheme}, whole runs at {resolution} x {resolution}")
            wanted = codes if resolution in options.run_resolution else ours
            results["runs"] += accuracy_rows(wanted, scheme, resolution, options)
            results["equal_time"] = at_equal_time(results["runs"])
            keep()
    keep()
    print(_table(results))


def _table(results: dict[str, Any]) -> str:
    parts = []
    for row in results["right_hand_sides"]:
        parts.append(
            f"{row['scheme']}: {row['particles']} particles, h = {row['h_over_dx']:g} dx, "
            f"{row['neighbors']:.0f} neighbours\n" + _speed_table(row["codes"])
        )
        for name, found in row["codes"].items():
            parts.append(f"{name}: " + "; ".join(found["terms"]))
        parts += [f"left out: {reason}" for reason in row["failed"].values()]
    if results["runs"]:
        parts.append("whole runs, errors at the end\n" + _run_table(results["runs"]))
    if results["equal_time"]:
        parts.append(
            "velocity error of this library in a peer's time, and time to a peer's error; "
            "* bound, beyond this library's runs\n" + _equal_table(results["equal_time"])
        )
    parts += [f"missing: {name}, {reason}" for name, reason in results["missing"].items()]
    return "\n\n".join(parts)


def _speed_table(codes: dict[str, Any]) -> str:
    header = ("code", "ms", "min", "spread", "ns/pair", "cores", "CPU ns/pair", "times ours",
              "CPU times ours", "neighbours ms", "du/dt apart %", "drho/dt apart %")  # fmt: skip
    rows = [
        (
            name,
            *(number(1e3 * c["right_hand_side"][key]) for key in ("median", "min", "spread")),
            *(number(c[key]) for key in (
                "ns_per_pair", "cores_busy", "busy_ns_per_pair", "ratio", "ratio_busy")),
            number(1e3 * c["neighbors"]["median"]),
            number(c.get("acceleration_differs_percent")),
            number(c.get("density_rate_differs_percent")),
        )
        for name, c in codes.items()
    ]  # fmt: skip
    return format_rows(header, rows)


def _run_table(runs: list[dict[str, Any]]) -> str:
    header = ("scheme", "N", "code", "run s", "steps", "sums", "velocity %", "pressure %",
              "energy %", "fault")  # fmt: skip
    rows = [
        (
            run["scheme"], str(run["resolution"]), run["code"], number(run.get("seconds")),
            str(run.get("steps", "-")), str(run.get("right_hand_sides", "-")),
            *(number(run.get(f"{name}_error_percent")) for name in (
                "velocity", "pressure", "kinetic_energy")),
            (run["fault"] or "-")[:40],
        )
        for run in runs
    ]  # fmt: skip
    return format_rows(header, rows)


def _equal_table(compared: list[dict[str, Any]]) -> str:
    header = ("scheme", "N", "code", "run s", "error %", "ours %", "error ratio", "ours s",
              "time ratio")  # fmt: skip
    rows = [
        (
            c["scheme"], str(c["resolution"]), c["code"], number(c["seconds"]),
            number(c["velocity_error_percent"]),
            number(c["our_error_percent_in_that_time"]) + "*" * c["error_bound"],
            number(c["error_ratio"]),
            number(c["our_seconds_for_that_error"]) + "*" * c["seconds_bound"],
            number(c["time_ratio"]),
        )
        for c in compared
    ]  # fmt: skip
    return format_rows(header, rows)


if __name__ == "__main__":
    raise SystemExit(main())
