"""Rows of stored results, as text of tables."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
Row = dict[str, Any]


def results(name: str, rows: str = "rows") -> list[Row]:
    """Rows of a benchmark, which are called so in its file."""
    path = ROOT / "benchmarks" / "results" / f"{name}.json"
    return json.loads(path.read_text(encoding="utf-8"))[rows]


def markdown(header: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A table."""
    lines = [tuple(header), *map(tuple, rows)]
    lines.insert(1, ("---",) * len(lines[0]))
    cells = [[f" {cell} " if cell else " " for cell in line] for line in lines]
    return "\n".join(f"|{'|'.join(line)}|" for line in cells)


def short(value: float | None, digits: int = 2) -> str:
    """A number to a few digits, never by powers of ten unless it is tiny."""
    return "" if value is None else f"{float(f'{value:.{digits}g}'):g}"


def several(row: Row, *names: str) -> str:
    """Errors of a row, a slash between."""
    return " / ".join(short(row[f"{name}_error_percent"]) for name in names)


def density(row: Row) -> str:
    """The range over rho0."""
    return f"{row['density_low']:.3f} to {row['density_high']:.3f}"


def duration(seconds: float) -> str:
    """In seconds, or in milliseconds where it is short."""
    return f"{short(seconds)} s" if seconds >= 0.05 else f"{short(1e3 * seconds)} ms"
