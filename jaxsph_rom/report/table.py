"""Errors and times of all cases as text for a terminal."""

from __future__ import annotations

import itertools
import math
import textwrap
from collections.abc import Sequence

import numpy as np

from .case import Case

WIDTH = 120  # columns of text
ABSENT = "-"

# First and second header line of each column; `<` for text, `>` for numbers.
COLUMNS = (
    ("", "Re", ">"),
    ("", "case", "<"),
    ("", "M", ">"),
    ("", "projection", "<"),
    ("tau", "[s]", ">"),
    ("velocity", "peak %", ">"),
    ("", "median %", ">"),
    ("pressure", "peak %", ">"),
    ("", "median %", ">"),
    ("full", "[s]", ">"),
    ("reduced", "[s]", ">"),
    ("full/", "reduced", ">"),
    ("", "stable", "<"),
)
PROJECTION = 3


def format_table(cases: Sequence[Case]) -> str:
    """The cases as an aligned table of at most 120 columns, in the order given.

    Every row holds the errors (percent relative discrepancy, peak and median over time) and the
    times (wall clock without compilation) of one case, so that neither is read without the other.
    A line names the scene, the inner product and the hyper-reduction where they change. What
    made a run unstable or doubtful, and how far off a pressure is that is uniform, stands below.

    Args:
        cases: the cases to show.

    Returns:
        Lines joined by newlines, none at the end.
    """
    cases = list(cases)
    body = [cells(case) for case in cases]
    headers = [[column[0] for column in COLUMNS], [column[1] for column in COLUMNS]]
    widths = [max(map(len, column)) for column in zip(*headers, *body, strict=True)]
    gap = "  " if sum(widths) + 2 * (len(widths) - 1) <= WIDTH else " "
    excess = sum(widths) + len(gap) * (len(widths) - 1) - WIDTH
    if excess > 0:
        widths[PROJECTION] = max(len(headers[1][PROJECTION]), widths[PROJECTION] - excess)

    def line(texts: Sequence[str]) -> str:
        aligned = (
            f"{text[:width]:{column[2]}{width}}"
            for text, width, column in zip(texts, widths, COLUMNS, strict=True)
        )
        return gap.join(aligned).rstrip()

    lines = [line(headers[0]), line(headers[1])]
    lines.append("-" * max(map(len, [*lines, *map(line, body)])))
    rows = zip(cases, body, strict=True)
    for name, group in itertools.groupby(rows, key=lambda row: heading(row[0])):
        lines += [*textwrap.wrap(name, WIDTH), *(line(texts) for _, texts in group)]
    for text in remarks(cases):
        lines += textwrap.wrap(text, WIDTH, subsequent_indent="    ")
    return "\n".join(lines)


def cells(case: Case) -> list[str]:
    """A case as the texts of its columns."""
    return [
        f"{case.reynolds:g}",
        "predicted" if case.predicted else "trained",
        str(case.modes),
        case.projection,
        _tau(case.tau),
        _number(case.velocity_peak_percent),
        _number(case.velocity_median_percent),
        _number(case.pressure_peak_percent),
        _number(case.pressure_median_percent),
        _number(case.fom_seconds),
        _number(case.rom_seconds),
        _number(case.time_ratio),
        _verdict(case),
    ]


def _number(value: float | None) -> str:
    """Three significant digits, in seven characters at most: 0.0123, 4.56, 789, 12345, 1.2e+09."""
    if value is None or not math.isfinite(value):
        return ABSENT
    if value == 0 or 1e-3 <= abs(value) < 100:
        return f"{value:#.3g}" if value else "0"
    return f"{value:.0f}" if 100 <= abs(value) < 1e5 else _short(f"{value:.1e}")


def _tau(value: float | None) -> str:
    if value is None or not math.isfinite(value):
        return ABSENT
    return np.format_float_scientific(value, precision=2, trim="-", exp_digits=1)


def _short(text: str) -> str:
    """1e-04 as 1e-4."""
    return text.replace("e-0", "e-").replace("e+0", "e+")


def _verdict(case: Case) -> str:
    if case.sound:
        return "yes"
    doubtful = case.doubt is not None and case.fault is None
    word, time = ("doubtful", case.doubt_time) if doubtful else ("unstable", case.fault_time)
    return word if time is None or not math.isfinite(time) else f"{word}, {time:.3g} s"


def heading(case: Case) -> str:
    """What cases have in common that stand in one block."""
    return f"{case.scene}: {case.inner_product} inner product, hyper-reduction {case.hyper}"


def remarks(cases: Sequence[Case]) -> list[str]:
    """What made cases unstable or doubtful, and of pressures without a percentage, each once."""
    said = [(case, text) for case in cases for text in (case.doubt, case.fault) if text]
    said += [(case, off(case)) for case in cases if case.uniform_pressure]
    return list(
        dict.fromkeys(
            f"Re {case.reynolds:g}, M {case.modes}, {case.projection}: {text}"
            for case, text in said
        )
    )


def off(case: Case) -> str:
    """How far off a pressure is that is uniform."""
    peak, median = case.pressure_peak_pascal, case.pressure_median_pascal
    return (
        f"no pressure to compare with (uniform), off by {peak:.2g} Pa at most, "
        f"{median:.2g} Pa in the median"
    )
