"""What the measurements say: Pareto fronts, the cheapest setting for an accuracy, the figure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from jaxsph.plotting.style import (
    BLACK,
    BLUE,
    FAINT,
    GREEN,
    INK,
    VERMILLION,
    dress,
    legend_below,
    save,
    sheet,
)  # fmt: skip

from ..measure import format_rows, number
from .settings import FAMILIES, FULL, MOVING, SAMPLED, TENSOR

VELOCITY, PRESSURE = "velocity_peak_percent", "pressure_median_percent"
_MARKS = {FULL: (BLACK, "o"), MOVING: (VERMILLION, "s"), TENSOR: (BLUE, "^"), SAMPLED: (GREEN, "D")}
_WANTED = {VELOCITY: (20.0, 10.0, 5.0, 3.0, 2.0, 1.0, 0.5), PRESSURE: (50.0, 20.0, 10.0, 5.0, 3.0)}
_FAR = 4.0  # times the worst full model's error, beyond which points are shown at the rim


def seconds_of(row: dict[str, Any]) -> float:
    """Median run time [s] of a row."""
    return row["run_seconds"]["median"]


def pareto_front(points: Sequence[tuple[float, float]]) -> list[int]:
    """Numbers of the points (cost, error) that no other is better than, by increasing cost.

    A point is better than another if neither its cost nor its error is larger, and one is smaller.
    """
    front: list[int] = []
    for k in sorted(range(len(points)), key=lambda k: tuple(points[k])):
        if not front or points[k][1] < points[front[-1]][1]:
            front.append(k)
    return front


def sound_rows(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Rows that reached their end with finite errors."""
    values = (VELOCITY, PRESSURE)
    return [
        row
        for row in rows
        if row["fault"] is None and all(np.isfinite(row[v] or np.nan) for v in values)
    ]


def cheapest(rows: Sequence[dict[str, Any]], measure: str, wanted: float) -> dict[str, Any] | None:
    """The row of least run time whose error is within what is wanted [%], if there is one."""
    within = [row for row in sound_rows(rows) if row[measure] <= wanted]
    return min(within, key=seconds_of, default=None)


def tables(scene: str, rows: Sequence[dict[str, Any]]) -> str:
    """All settings, and for each accuracy the cheapest full and the cheapest reduced one."""
    header = ("family", "setting", "velocity %", "median", "pressure %", "run s", "spread",
              "compile s", "offline s")  # fmt: skip
    body = []
    for row in sorted(sound_rows(rows), key=lambda r: (FAMILIES.index(r["family"]), seconds_of(r))):
        spread = row["run_seconds"]["spread"] if row["run_seconds"]["repeats"] > 1 else None
        body.append((
            row["family"], row["label"], number(row[VELOCITY]),
            number(row["velocity_median_percent"]), number(row[PRESSURE]), number(seconds_of(row)),
            number(spread, 2), number(row["compile_seconds"], 2), number(row["offline_seconds"]),
        ))  # fmt: skip
    parts = [f"{scene}: relative L2 errors", format_rows(header, body)]
    for row in rows:
        if row["fault"] is not None:
            parts.append(f"failed: {row['family']}, {row['label']}: {row['fault']}")
    answers = []
    for measure, levels in _WANTED.items():
        for wanted in levels:
            found = [
                cheapest([row for row in rows if (row["family"] == FULL) == full], measure, wanted)
                for full in (True, False)
            ]
            answers.append((f"{measure.partition('_')[0]} {wanted:g} %", *map(_answer, found)))
    parts += ["", format_rows(("wanted", "cheapest full model", "cheapest reduced run"), answers)]
    return "\n".join(parts)


def _answer(row: dict[str, Any] | None) -> str:
    if row is None:
        return "none"
    family = "" if row["family"] == FULL else f"{row['family']}: "
    return f"{family}{row['label']} ({number(seconds_of(row))} s)"


def figure(scene: str, rows: Sequence[dict[str, Any]], case: Mapping[str, Any], path: Path) -> Path:
    """Error over run time, velocity left and pressure right; the Pareto front as a line.

    Args:
        scene: its name.
        rows: of its settings.
        case: `reynolds`, and whether the flow is `steady`.
        path: of the image.
    """
    titles = {VELOCITY: "velocity, peak over time", PRESSURE: "pressure, median over time"}
    if case["steady"]:
        titles[PRESSURE] = "pressure, mean over the last second"
    made = sheet(12, 5.2)
    made.suptitle(f"{scene}, Re = {case['reynolds']:g}", color=INK, fontsize=11)
    handles: dict[str, Any] = {}
    named: list[tuple[Any, ...]] = []
    for axes, measure in zip(made.subplots(1, 2), (VELOCITY, PRESSURE), strict=True):
        dress(axes, "run time [s]", "relative L2 error [%]", titles[measure])
        axes.set(xscale="log", yscale="log")
        axes.yaxis.set_major_formatter("{x:g}")
        axes.yaxis.set_minor_formatter(_few)
        kept = sound_rows(rows)
        if not kept:
            continue
        full = [row[measure] for row in kept if row["family"] == FULL]
        rim = _FAR * max(full, default=np.inf)
        points = [(seconds_of(row), min(row[measure], rim)) for row in kept]
        _front(axes, points, FAINT, 5.0, "Pareto front", handles)
        _front(
            axes,
            [p for p, row in zip(points, kept, strict=True) if row["family"] == FULL],
            BLACK, 1.0, "front of the full models", handles,
        )  # fmt: skip
        for family, (color, marker) in _MARKS.items():
            here = [p for p, row in zip(points, kept, strict=True) if row["family"] == family]
            if here:
                (handles[family],) = axes.plot(
                    *zip(*here, strict=True), color=color, marker=marker, linestyle="",
                    markersize=5.5, alpha=0.85, markeredgecolor="white", markeredgewidth=0.4,
                    label=family,
                )  # fmt: skip
        axes.margins(x=0.12, y=0.1)
        named.append((axes, kept, points))
    legend_below(made, list(handles.values()))
    for panel in named:  # once the sheet has its size
        _write_labels(*panel)
    return save(made, path)


def _few(value: float, _) -> str:
    """Labels between decades at 2, 3 and 5 only."""
    return f"{value:g}" if f"{value:e}"[0] in "235" else ""


def _front(axes, points, color: str, width: float, label: str, handles: dict[str, Any]) -> None:
    """A staircase: what error a time buys."""
    if points:
        steps = [points[k] for k in pareto_front(points)]
        (handles[label],) = axes.step(
            *zip(*steps, strict=True), where="post", color=color, linewidth=width, label=label,
            zorder=1, marker="o", markersize=2.4 * width,
        )  # fmt: skip


def _write_labels(axes, rows: Sequence[dict[str, Any]], points) -> None:
    """Names of the points on the front of the full models and on that of the reduced ones.

    One that would cover another is left out; a front's ends come first.
    """
    axes.figure.canvas.draw()  # places are known from now on
    renderer = axes.figure.canvas.get_renderer()
    taken = []
    for reduced in (False, True):
        of = [k for k, row in enumerate(rows) if (row["family"] != FULL) == reduced]
        front = [of[k] for k in pareto_front([points[k] for k in of])]
        for k in dict.fromkeys([*front[-1:], *front[:1], *front[1:-1]]):
            color = _MARKS[rows[k]["family"]][0]
            for offset, align in (((6, 4), "left"), ((-6, -11), "right"), ((6, -11), "left"),
                                  ((-6, 4), "right")):  # fmt: skip
                text = axes.annotate(
                    rows[k]["label"], points[k], xytext=offset, textcoords="offset points",
                    color=color, fontsize=7, ha=align,
                )  # fmt: skip
                box = text.get_window_extent(renderer)
                inside = axes.bbox.x0 <= box.x0 and box.x1 <= axes.bbox.x1 + 40
                if inside and not any(box.overlaps(other) for other in taken):
                    taken.append(box)
                    break
                text.remove()
