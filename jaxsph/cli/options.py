"""Options that commands share: their types, what their words stand for; rows as printed."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from jaxsph_command.scenes import SCALES as SCALES

from ..arrangements import JitteredLattice, Lattice, Packed, Stirred
from ..integrate import AutomaticSteps, FixedSteps
from ..io import check_target
from ..record import plain

STEPPING = {"fixed": FixedSteps(), "automatic": AutomaticSteps()}
ARRANGEMENTS = {
    "packed": Packed,
    "lattice": lambda seed: Lattice(),
    "jittered": JitteredLattice,
    "stirred": Stirred,
}
MOST_NUMBERS = 100_000  # Reynolds numbers in a call


def positive_float(text: str) -> float:
    """A finite number above zero."""
    value = float(text)
    if not 0.0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"must be positive and finite, got {text}")
    return value


def finite_float(text: str) -> float:
    """A finite number."""
    value = float(text)
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"must be finite, got {text}")
    return value


def positive_int(text: str) -> int:
    """A whole number above zero."""
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"must be at least 1, got {text}")
    return value


def whole_number(text: str) -> int:
    """0, 1, 2, ..."""
    value = int(text)
    if value < 0:
        raise argparse.ArgumentTypeError(f"must be at least 0, got {text}")
    return value


def reynolds_numbers(text: str) -> list[float]:
    """A Reynolds number, or a range of them."""
    if ":" not in text:
        return [positive_float(text)]
    try:
        start, stop, count = text.split(":")
        start, stop, count = positive_float(start), positive_float(stop), positive_int(count)
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"give a number or START:STOP:COUNT, as 100:250:50, got {text}"
        ) from None
    if count < 2 or not start < stop:
        raise argparse.ArgumentTypeError(
            f"START:STOP:COUNT needs START below STOP and a COUNT of at least 2, got {text}"
        )
    if count > MOST_NUMBERS:
        raise argparse.ArgumentTypeError(
            f"at most {MOST_NUMBERS} Reynolds numbers a call, got {text}"
        )
    return np.linspace(start, stop, count).tolist()


def seed(text: str) -> int:
    """A seed of random numbers."""
    value = int(text)
    if not 0 <= value < 2**32:
        raise argparse.ArgumentTypeError(f"must be from 0 to 2^32 - 1, got {text}")
    return value


def margin(text: str) -> float:
    """A factor on allocated capacities."""
    value = float(text)
    if not 1.0 <= value < math.inf:
        raise argparse.ArgumentTypeError(f"must be at least 1, got {text}")
    return value


def result_file(out: Path | None, folder: Path, name: str) -> Path:
    """Where a file of results goes: to the folder that is asked for, or to the file where `out` has
    the file's ending; else to the folder that is usual."""
    out = folder if out is None else out
    return out if out.suffix == Path(name).suffix or out.is_file() else out / name


def add_json_option(parser: argparse.ArgumentParser) -> None:
    """Add what every command takes that has results; `write_json` writes them."""
    parser.add_argument(
        "--json", type=writable, metavar="FILE", help="write the results to FILE as well"
    )


def write_json(path: Path | None, results: Mapping[str, Any]) -> None:
    """Write results where they are asked for, strict JSON: None for NaN and infinity."""
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        text = json.dumps(plain(dict(results)), indent=2, allow_nan=False)
        path.write_text(text + "\n", encoding="utf-8")


def writable(text: str) -> Path:
    """The path of a file that can be written."""
    try:
        check_target(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    return Path(text)


def bytes_in(folder: Path) -> int:
    """Of all files in a folder and below it."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


def bytes_told(count: int) -> str:
    """Bytes as people read them."""
    value, units = float(count), ["B", "kB", "MB", "GB", "TB"]
    while value >= 1000.0 and len(units) > 1:
        value /= 1000.0
        units.pop(0)
    return f"{value:.3g} {units[0]}"


def print_rows(rows: dict[str, str]) -> None:
    """Names and values, aligned."""
    for name, value in rows.items():
        print(f"{name:22} {value}")
