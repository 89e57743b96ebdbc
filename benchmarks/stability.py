"""Hard cases: what each ends in, and how near it comes to its bounds.

    python -m benchmarks.stability
    python -m benchmarks.stability --slow

The table of `hard_cases/cases.py`, which the tests assert: a blow-up, an overflow or a NaN is
prevented or named, and never written to a file as a result. Cases that are done and have not
changed since are not run again; the page is made anew from the results each time.
"""

from __future__ import annotations

import warnings
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

from jaxsph.environment import environment
from jaxsph.io import check_target
from jaxsph_rom.report.plain import plain

from .hard_cases.cases import CASES
from .hard_cases.judge import Case, complaints, run_case
from .measure import number, progress, tell
from .table import Table, command

_HEAD = """# Hard cases

<!-- Made by `python -m benchmarks.stability` from benchmarks/results/stability.json. -->

The promise: a blow-up, an overflow or a NaN is either prevented or named, and never written to a
file as a result. Each case below runs into a trajectory file that is then read back. It is
*finished* within all its bounds, *refused* before it starts (`ValueError`), or ended by a named
*fault* (`SimulationError`), whichever the case allows; no number in its file may be anything but
finite. The cases are in `benchmarks/hard_cases`; quick ones run with the tests, long ones with
`-m slow`.
"""


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: a case broke its promise, 2: bad input."""
    return command("stability", __doc__, _arguments, _run, argv)


def _run(options) -> int:
    chosen = _chosen(options)
    check_target(options.page)
    kept = Table(options.json, ("name",), rows="cases")
    changed = [case for case in chosen if not kept.has(_definition(case))]
    tell(f"{len(chosen) - len(changed)} of {len(chosen)} cases done before")
    order = list(CASES)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", ".*allocated it anew")  # counted as `enlarged`
        for case in changed:
            row = _row(case)
            # in the table's order, and without cases that it no longer has
            others = [r for r in kept.rows if r["name"] in CASES and r["name"] != case.name]
            kept.rows[:] = sorted((*others, row), key=lambda r: order.index(r["name"]))
            kept.write()
    rows = {row["name"]: row for row in kept.rows if row["name"] in CASES}
    options.page.parent.mkdir(parents=True, exist_ok=True)
    options.page.write_text(page(rows), encoding="utf-8")
    broken = [row for row in rows.values() if row["complaints"] and not row["wrong"]]
    for row in broken:
        print(f"{row['name']}: {'; '.join(row['complaints'])}")
    known = [row for row in rows.values() if row["complaints"] and row["wrong"]]
    good = len(rows) - len(broken) - len(known)
    print(f"{good} of {len(rows)} cases as expected, {len(known)} known faults; {options.page}")
    return 1 if broken else 0


def _arguments(add) -> None:
    add("--slow", action="store_true", help="the long cases too")
    add("--cases", nargs="+", metavar="PATTERN",
        help="those whose names match, such as 'tank/*', long ones too "
        "(default: all quick ones)")  # fmt: skip
    add("--page", type=Path, default=Path("docs/stability.md"), metavar="FILE",
        help="default: %(default)s")  # fmt: skip


def _chosen(options) -> list[Case]:
    """The cases asked for.

    Raises:
        ValueError: if a pattern matches none.
    """
    if options.cases is None:
        return [case for case in CASES.values() if options.slow or not case.slow]
    for pattern in options.cases:
        if not any(fnmatch(name, pattern) for name in CASES):
            raise ValueError(f"cases: no name matches {pattern!r}; one is {next(iter(CASES))}.")
    return [c for c in CASES.values() if any(fnmatch(c.name, p) for p in options.cases)]


def _definition(case: Case) -> dict[str, Any]:
    """What a case is, JSON-like; one that has changed is run again."""
    bounds = [
        {"name": b.name, "limit": b.limit, "at_least": b.at_least, "reason": b.reason,
         "measures": " ".join(b.measure.__doc__.split()).rstrip(".")}
        for b in case.bounds
    ]  # fmt: skip
    return plain({
        "name": case.name,
        "what": case.what,
        "slow": case.slow,
        "precision": case.precision,
        "endings": [str(ending) for ending in case.endings],
        "says": case.says,
        "codes": [code.name for code in case.codes],
        "bounds": bounds,
        "wrong": case.wrong,
    })  # fmt: skip


def _row(case: Case) -> dict[str, Any]:
    outcome = run_case(case, progress)
    found = complaints(case, outcome)
    tell(f"{case.name}: {outcome.ending}, {outcome.seconds:.1f} s {'; '.join(found)}")
    values = outcome.values
    used = {b.name: b.used(values[b.name]) for b in case.bounds if b.name in values}
    return _definition(case) | plain({
        "ending": str(outcome.ending),
        "words": outcome.says,
        "code": None if outcome.code is None else outcome.code.name,
        "recorded": outcome.recorded,
        "finite": outcome.finite,
        "values": values,
        "used": used,
        "complaints": found,
        "lists_enlarged": outcome.enlarged,
        "steps": outcome.steps,
        "seconds_with_compilation": outcome.seconds,
        "environment": environment(),
    })  # fmt: skip


def page(rows: dict[str, dict[str, Any]]) -> str:
    """The documentation page of results, by the names of their cases."""
    wrong = [row for row in rows.values() if row["wrong"] and row["complaints"]]
    not_run = [f"`{name}`" for name in CASES if name not in rows]
    parts = [_HEAD]
    if wrong:
        parts.append("## Known faults\n\nThese cases do not keep the promise yet.\n\n" + "\n".join(
            f"- `{row['name']}`: {row['wrong']}" for row in wrong) + "\n")  # fmt: skip
    for family in dict.fromkeys(name.partition("/")[0] for name in rows):
        of_family = [r for name, r in rows.items() if name.partition("/")[0] == family]
        table = _table(
            ("case", "what is hard", "ends", "measured, and share of the bound", "s"),
            [_cells(row) for row in of_family],
        )
        parts.append(f"## {family}\n\n{table}")
    parts.append("## Bounds\n\n" + _table(
        ("name", "measures", "bound", "reason"), _bound_cells(rows.values())))  # fmt: skip
    if not_run:
        parts.append(f"## Not run yet\n\n{', '.join(not_run)}.\n")
    return "\n".join(parts)


def _cells(row: dict[str, Any]) -> tuple[str, ...]:
    broken = " **not as promised**" if row["complaints"] else ""
    measured = [
        f"{name} {number(value)} ({100.0 * row['used'][name]:.0f} %)"
        for name, value in row["values"].items()
    ]
    return (
        f"`{row['name']}`",
        row["what"],
        row["ending"] + broken,
        "; ".join(measured) or row["words"],
        number(row["seconds_with_compilation"], 2),
    )


def _bound_cells(rows) -> list[tuple[str, ...]]:
    """Each bound once, in the order of the cases."""
    bounds = {
        (b["name"], b["measures"], f"{'>=' if b['at_least'] else '<='} {b['limit']:g}", b["reason"])
        for row in rows
        for b in row["bounds"]
    }
    return sorted(bounds)


def _table(header: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """A Markdown table."""
    escaped = [tuple(cell.replace("|", r"\|") for cell in row) for row in rows]  # bars end cells
    lines = [header, ("---",) * len(header), *escaped]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


if __name__ == "__main__":
    raise SystemExit(main())
