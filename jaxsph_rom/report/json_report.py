"""The report as a file that other programs read."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from .case import Case
from .plain import plain

SCHEMA_VERSION = 1
FILE_NAME = "report.json"


def write_report(
    path: str | os.PathLike[str],
    cases: Sequence[Case],
    environment: Mapping[str, Any],
    extra: Mapping[str, Any] | None = None,
) -> Path:
    """Write the cases as strict JSON, whole or not at all.

    Keys: `schema_version`, `cases` (a list of `Case.to_dict()`), `environment`, and those of
    `extra`. NaN and infinity are written as null.

    Args:
        path: the file, or an existing folder in which `report.json` is written.
        cases: the cases, in the order of the table.
        environment: device, dtype, versions and what else the numbers depend on.
        extra: further keys, for example the cumulative energy [%] of each space.

    Returns:
        The file's path.

    Raises:
        ValueError: if `extra` has one of the report's own keys, or a value JSON cannot hold.
    """
    path = Path(path)
    if path.is_dir():
        path = path / FILE_NAME
    report = {
        "schema_version": SCHEMA_VERSION,
        "cases": [case.to_dict() for case in cases],
        "environment": plain(environment),
    }
    further = plain(extra or {})
    if taken := sorted(report.keys() & further.keys()):
        raise ValueError(f"extra: {', '.join(taken)} is a key of the report; name it otherwise")
    text = json.dumps(report | further, indent=2, allow_nan=False) + "\n"

    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        unfinished.write_text(text, encoding="utf-8")
        os.replace(unfinished, path)
    finally:
        unfinished.unlink(missing_ok=True)
    return path
