"""The cheapest setting within an error, or the most accurate within a time."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

TABLE = Path(__file__).with_name("work_precision.json")  # by `benchmarks.work_precision`
_UNITS = {"ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0}


@dataclass(frozen=True)
class Row:
    """A setting that was measured.

    Args:
        family: `full`, or the kind of reduced model.
        label: the setting in a few words.
        velocity_percent: relative L2 error of the velocity, largest over time [%].
        pressure_percent: that of the pressure, median over time [%].
        seconds: of a run, without compilation.
        compile_seconds: of its compilation; None if its program was compiled before.
        offline_seconds: before the first run, training runs included; None for a full model.
        command: that runs it.
    """

    family: str
    label: str
    velocity_percent: float
    pressure_percent: float
    seconds: float
    compile_seconds: float | None
    offline_seconds: float | None
    command: str


@dataclass(frozen=True)
class Advice:
    """What to run.

    Args:
        best: the setting: the cheapest that is within all that was asked, the most accurate where
            only a time was asked for, or the nearest to it where none is.
        reached: whether it is within all that was asked.
        untrained: the full model that answers the same, where `best` is a reduced one and one does.
    """

    best: Row
    reached: bool
    untrained: Row | None = None

    @property
    def paid_back_after(self) -> int | None:
        """Runs after which the training of `best` has cost less than runs of `untrained`."""
        if self.untrained is None or self.untrained.seconds <= self.best.seconds:
            return None
        saved = self.untrained.seconds - self.best.seconds
        return math.ceil((self.best.offline_seconds or 0.0) / saved)


def read_table(path: Path = TABLE) -> dict[str, Any]:
    """The measurements: `grid`, `machine`, `versions` and, by name, `scenes` with their `rows`.

    Raises:
        ValueError: if the file is missing or holds something else.
    """
    try:
        table = json.loads(path.read_text(encoding="utf-8"))
        for scene in table["scenes"].values():
            names = [field.name for field in fields(Row)]
            scene["rows"] = [Row(**{name: row[name] for name in names}) for row in scene["rows"]]
        _ = table["machine"], table["versions"]
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise ValueError(
            f"{path}: no table of measurements ({type(error).__name__}); make one by "
            "`python -m benchmarks.work_precision`."
        ) from None
    return table


def advise(
    rows: Sequence[Row],
    velocity: float | None = None,
    pressure: float | None = None,
    budget: float | None = None,
) -> Advice:
    """The cheapest row within the errors, or the most accurate within the time if none is given.

    Where no row is within the errors and the time, `reached` is false and the row is the one that
    misses the errors by least, of those within the time if there are any.

    Args:
        rows: of a scene.
        velocity, pressure: errors wanted [%].
        budget: time a run may take [s].

    Raises:
        ValueError: if nothing is asked for, or there is no row.
    """
    if velocity is None and pressure is None and budget is None:
        raise ValueError("give --velocity-error, --pressure-error or --time-budget.")
    if not rows:
        raise ValueError("the table has no measurements of this scene.")

    def within(row: Row) -> bool:
        return _miss(row, velocity, pressure) <= 1.0 and _affordable(row, budget)

    if velocity is None and pressure is None:
        good = [row for row in rows if _affordable(row, budget)]
        if not good:
            return Advice(min(rows, key=lambda row: row.seconds), False)
        return _answer(good, lambda row: (row.velocity_percent, row.seconds))
    good = [row for row in rows if within(row)]
    if good:
        return _answer(good, lambda row: row.seconds)
    some = [row for row in rows if _affordable(row, budget)] or rows
    return Advice(min(some, key=lambda row: _miss(row, velocity, pressure)), False)


def _answer(good: Sequence[Row], key) -> Advice:
    best = min(good, key=key)
    full = [row for row in good if row.offline_seconds is None]
    if best.offline_seconds is None or not full:
        return Advice(best, True)
    return Advice(best, True, min(full, key=key))


def _miss(row: Row, velocity: float | None, pressure: float | None) -> float:
    """The largest ratio of an error to the one wanted: at most 1 if all are met."""
    pairs = ((row.velocity_percent, velocity), (row.pressure_percent, pressure))
    return max((found / wanted for found, wanted in pairs if wanted is not None), default=0.0)


def _affordable(row: Row, budget: float | None) -> bool:
    return budget is None or row.seconds <= budget


def percent(text: str) -> float:
    """A percentage, `1%` or `1`.

    Raises:
        ValueError: if it is not a positive number.
    """
    return _positive(text.strip().removesuffix("%"), text, "a percentage as 1% or 0.5")


def seconds(text: str) -> float:
    """A time [s], `10s`, `200ms`, `2min`, `1h` or `10`.

    Raises:
        ValueError: if it is not a positive number with a known unit.
    """
    bare = text.strip()
    for unit in sorted(_UNITS, key=len, reverse=True):
        if bare.endswith(unit):
            number = _positive(bare.removesuffix(unit), text, _TIMES)
            return number * _UNITS[unit]
    return _positive(bare, text, _TIMES)


_TIMES = "a time as 10s, 200ms, 2min or 10"


def _positive(number: str, text: str, wanted: str) -> float:
    try:
        value = float(number)
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        raise ValueError(f"give {wanted}, above zero; got {text!r}")
    return value
