"""Inverse problems by gradients through full and reduced models.

    python -m benchmarks.inverse viscosity initial-field

Each is a file of this folder; all are small enough for a notebook. Steps of optax, data from runs
of our own with noise where it says so. Results of problems that are not named stay in the file.
"""

from __future__ import annotations

from jaxsph.environment import environment

from ..measure import format_rows, number, read_json, write_json
from ..table import command
from . import initial_field, lid_profile, memory_and_closure, through_reduced, viscosity

PROBLEMS = {
    "viscosity": viscosity.solve,
    "initial-field": initial_field.solve,
    "lid-profile": lid_profile.solve,
    "memory-and-closure": memory_and_closure.solve,
    "through-reduced": through_reduced.solve,
}


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 2: bad input."""
    return command("inverse", __doc__, _arguments, _run, argv)


def _arguments(add) -> None:
    add("problems", nargs="*", metavar="PROBLEM",
        help=f"of {', '.join(PROBLEMS)} (default: all)")  # fmt: skip


def _run(options) -> None:
    unknown = [name for name in options.problems if name not in PROBLEMS]
    if unknown:
        raise ValueError(f"problem: {unknown[0]!r} is not one of {', '.join(PROBLEMS)}.")
    results = read_json(options.json) or {}
    for name in options.problems or PROBLEMS:
        results[name] = PROBLEMS[name]() | {"environment": environment()}
        write_json(options.json, results)
    print(_table(results))


def _table(results) -> str:
    rows = [
        (name, key.replace("_", " "), number(value))
        for name, found in results.items()
        for part in (found, *(v for v in found.values() if isinstance(v, dict)))
        for key, value in part.items()
        if isinstance(value, float | int)
    ]
    return format_rows(("problem", "quantity", "value"), rows)


if __name__ == "__main__":
    raise SystemExit(main())
