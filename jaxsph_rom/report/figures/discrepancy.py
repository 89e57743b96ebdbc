"""Relative discrepancy of reduced runs over time."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from jaxsph.plotting.style import INK, dress, finite_range, legend_below, line_style, save, sheet

DECADES = 1.5  # a range of values wider than this is drawn on a logarithmic axis
DEEPEST, HIGHEST = 1e-4, 1e4  # percent; start-up round-off and blow-ups are cut off there

History = tuple[str, np.ndarray, np.ndarray, np.ndarray]
Floor = tuple[np.ndarray, np.ndarray] | None
FLOOR = "full run in the same basis"  # in the legend
_DOTS = {"linestyle": (0, (1, 1.5)), "linewidth": 1.2}


def discrepancy_history(
    histories: Sequence[History], path: str | os.PathLike[str], floors: Sequence[Floor] = ()
) -> Path:
    """Percent relative discrepancy over time, velocity left and pressure right.

    A run that ends before its time does (NaN, infinity, above 10^4 percent) has a cross there. A
    panel without a number says that there was nothing to compare with.

    Args:
        histories: label, time (S,) [s], velocity (S,) [%] and pressure (S,) [%] of each run.
        path: the file to write.
        floors: velocity (S,) and pressure (S,) [%] of what each run's basis can hold at all, or
            None where that is not known; dotted, in the run's colour.

    Raises:
        ValueError: for arrays of other shapes, or floors of another number of runs.
    """
    floors = floors or [None] * len(histories)
    if len(floors) != len(histories):
        raise ValueError(
            f"floors: got {len(floors)} for {len(histories)} histories; give one each, or None."
        )
    figure = sheet(10, 4.2)
    panels = figure.subplots(1, 2)
    for axes, name, column in zip(panels, ("velocity norm", "pressure"), (2, 3), strict=True):
        dress(axes, "time t [s]", "relative discrepancy [%]", name)
        for number, history in enumerate(histories):
            _draw(axes, number, history[0], np.asarray(history[1]), np.asarray(history[column]))
        curves = axes.get_lines()
        held = [(k, np.asarray(floor[column - 2])) for k, floor in enumerate(floors) if floor]
        for k, percent in held:
            _check(f"floor of {histories[k][0]}", np.asarray(histories[k][1]), percent)
            axes.plot(histories[k][1], percent, color=curves[k].get_color(), **_DOTS)
        _scale(axes, [*(np.asarray(history[column]) for history in histories),
                      *(percent for _, percent in held)])  # fmt: skip
        if not any(np.isfinite(history[column]).any() for history in histories):
            axes.text(0.5, 0.5, "uniform: nothing to compare with", ha="center", va="center",
                      transform=axes.transAxes)  # fmt: skip
    handles = panels[0].get_lines()[: len(histories)]
    if any(floors):
        handles.append(Line2D([], [], color=INK, label=FLOOR, **_DOTS))
    legend_below(figure, handles)
    return save(figure, path)


def _draw(axes: Axes, number: int, label: str, time: np.ndarray, percent: np.ndarray) -> None:
    _check(label, time, percent)
    style = line_style(number)
    finite = np.isfinite(percent) & (percent <= HIGHEST)
    (curve,) = axes.plot(
        time,
        np.where(finite, percent, np.nan),
        label=label,
        linewidth=1.6,
        **style,
    )
    if finite.any() and not finite[-1]:
        last = np.flatnonzero(finite)[-1]
        axes.scatter(
            time[last],
            percent[last],
            marker="x",
            s=60,
            linewidths=2,
            color=curve.get_color(),
            zorder=4,
            clip_on=False,
        )


def _check(label: str, time: np.ndarray, percent: np.ndarray) -> None:
    if time.shape != percent.shape or time.ndim != 1:
        raise ValueError(
            f"histories: {label!r} has time {time.shape} and discrepancy {percent.shape}; "
            "both must be (S,)"
        )


def _scale(axes: Axes, percents: Sequence[np.ndarray]) -> None:
    positive = [percent[np.isfinite(percent) & (percent > 0)] for percent in percents]
    found = finite_range(positive)
    if found is None:
        return
    least, largest = found[0], min(found[1], HIGHEST)
    # A start from the full model's own state is exact: its first instants say nothing of the range.
    body = finite_range([np.quantile(p, [0.02]) for p in positive if p.size])
    low = max(least, DEEPEST, 0.5 * body[0] if body else least)
    if largest > low * 10**DECADES:
        axes.set_yscale("log", nonpositive="mask")
        axes.grid(True, which="minor", axis="y", color="#eeeeee", linewidth=0.4)
        axes.set_ylim(low / 1.5, largest * 1.5)
    else:
        axes.set_ylim(0, largest * 1.08)
