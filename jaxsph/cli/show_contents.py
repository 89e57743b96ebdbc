"""What a file of this project holds, whatever its kind: its attributes and its arrays."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from ..integrate import explanation
from ..sweeps import read_status, sweep_file

_LONG = 200  # characters of an attribute that are not shown
_LOST = 5  # members told of
_PASSED_OVER = ("format", "schema_version", "units", "versions", "identity", "content")


def file_format(path: Path) -> str | None:
    """The format of an HDF5 file as it says itself; None if it does not, or is none."""
    try:
        with h5py.File(path, "r", locking="best-effort") as file:
            return "VTKHDF" if "VTKHDF" in file else str(file.attrs["format"])
    except (OSError, KeyError):
        return None


def contents(path: Path) -> dict[str, str]:
    """Names and values of what a file holds, as people read them."""
    with h5py.File(path, "r") as file:
        rows = {"holds": f"{file_format(path)}, schema {file.attrs.get('schema_version', '?')}"}
        attributes: dict[str, Any] = {}
        arrays: dict[str, str] = {}

        def visit(name: str, part) -> None:
            if isinstance(part, h5py.Group):
                attributes.update({f"{name}.{key}": v for key, v in part.attrs.items()})
            else:
                unit = part.attrs.get("unit", "")
                shape = " x ".join(map(str, part.shape)) or "one number"
                arrays[name] = f"{shape}, {part.dtype}{f' [{unit}]' if unit else ''}"

        attributes |= {k: v for k, v in file.attrs.items() if k not in _PASSED_OVER}
        file.visititems(visit)
        shown = {name: _text(value) for name, value in attributes.items()}
        rows |= {name: text for name, text in shown.items() if len(text) <= _LONG}
        if file.attrs.get("format") == sweep_file.FORMAT:
            rows |= {"scene": json.loads(file.attrs["identity"])["scene"], **_members(path)}
        versions = json.loads(file.attrs.get("versions", "{}"))
    rows |= arrays
    if versions:
        rows["versions"] = ", ".join(f"{name} {text}" for name, text in versions.items())
    return rows


def _members(path: Path) -> dict[str, str]:
    """How the members of a sweep went."""
    status = read_status(path)
    lost = np.flatnonzero(status.code > 0)
    left = int((status.code == sweep_file.NOT_RUN).sum())
    rows = {"members": f"{len(status.code)}, {len(lost)} lost, {left} not run yet"}
    for number in lost[:_LOST]:
        fault = explanation(int(status.code[number]))
        rows[f"member {number}"] = f"lost at step {status.step[number]}: {fault}"
    return rows


def _text(value: Any) -> str:
    if isinstance(value, bytes):
        return value.decode()
    return " ".join(map(str, np.ravel(value))) if isinstance(value, np.ndarray) else str(value)
