"""The report as a page that people open."""

from __future__ import annotations

import itertools
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from jaxsph.report import page
from jaxsph.report.settings import origin_rows, parameter_rows

from .case import Case
from .table import COLUMNS, cells, heading, remarks
from .verdict import verdict

FILE_NAME = "report.html"
_NAMES = (
    "Re", "case", "M", "projection", "tau [s]", "velocity peak %", "velocity median %",
    "pressure peak %", "pressure median %", "full [s]", "reduced [s]", "full/reduced", "stable",
)  # fmt: skip

Shown = tuple[Path, str]


def write_html_report(
    path: str | os.PathLike[str],
    cases: Sequence[Case],
    figures: Sequence[Shown],
    settings: Mapping[str, Any],
    environment: Mapping[str, Mapping[str, Any]],
    command: str | None = None,
) -> Path:
    """Write the cases and their figures as one self-contained page, and return its path.

    Args:
        path: of the page.
        cases: in the order of the table.
        figures: PNG files, which the page takes in, and what each shows.
        settings: that all runs share, JSON-like.
        environment: as `jaxsph.environment.environment` gives it.
        command: that made it, if one did.

    Raises:
        ValueError: if there are no cases.
    """
    if not cases:
        raise ValueError("cases: got none; give at least one.")
    pieces = [page.heading("Errors and times")]
    numbers = [column[2] == ">" for column in COLUMNS]
    for name, group in itertools.groupby(cases, key=heading):
        pieces += [page.paragraph(name), page.table(_NAMES, map(cells, group), numbers)]
    pieces += map(page.paragraph, remarks(cases))
    pieces += map(page.paragraph, verdict(cases))
    pieces.append(
        page.paragraph(
            "Percent relative discrepancy from the full model, peak and median over time; run "
            "times are wall clock without compilation."
        )
    )
    pieces.append(page.heading("Figures"))
    pieces += [page.figure(file.read_bytes(), caption) for file, caption in figures]
    pieces += [page.heading("Scene and settings"), page.rows(parameter_rows(settings))]
    pieces += [page.heading("How this came about"), page.rows(origin_rows(environment, command))]
    return page.write_page(path, f"jaxsph-rom: {cases[0].scene}", pieces)
