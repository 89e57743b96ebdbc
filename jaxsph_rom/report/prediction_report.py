"""What a prediction leaves beside its coordinates: `report.json` and `report.html`."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from jaxsph.report import page
from jaxsph.report.settings import origin_rows

from . import html_report, json_report
from .plain import plain

LISTED = 200  # members that the page lists


def write_prediction_report(
    folder: Path,
    results: Mapping[str, Any],
    rows: Mapping[str, str],
    members: tuple[Sequence[str], Sequence[Sequence[str]]],
    notes: Iterable[str],
    figures: Iterable[tuple[bytes, str]],
    environment: Mapping[str, Mapping[str, Any]],
    command: str | None = None,
) -> Path:
    """Write both files, and return the path of the page.

    Args:
        folder: of the prediction.
        results: as they go into the JSON, with the environment.
        rows: what the command prints.
        members: names of columns, and the cells of each member.
        notes: what the model gets wrong on the runs that it was trained on, a line each.
        figures: PNG pictures, and what each shows.
        environment: as `jaxsph.environment.environment` gives it.
        command: that made it, if one did.
    """
    columns, lines = members
    text = json.dumps(plain({**results, **environment}), indent=2, allow_nan=False)
    (folder / json_report.FILE_NAME).write_text(text + "\n", encoding="utf-8")
    pieces = [page.heading("Prediction"), page.rows(rows)]
    pieces += [page.heading("Errors on the training runs"), *map(page.paragraph, notes)]
    shown = list(figures)
    if shown:
        pieces += [page.heading("Figures"), *(page.figure(*one) for one in shown)]
    pieces += [page.heading("Runs"), page.table(columns, lines[:LISTED], [True] * len(columns))]
    if len(lines) > LISTED:
        pieces.append(page.paragraph(f"The first {LISTED} of {len(lines)}; prediction.h5 has all."))
    pieces += [page.heading("How this came about"), page.rows(origin_rows(environment, command))]
    path = folder / html_report.FILE_NAME
    return page.write_page(path, f"jaxsph-rom: prediction of {results['scene']}", pieces)
