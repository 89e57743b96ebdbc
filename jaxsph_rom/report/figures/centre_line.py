"""Profiles of velocity and pressure on a line of probes."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from jaxsph.plotting.style import (
    BLACK,
    BLUE,
    GREEN,
    PALETTE,
    TEXT,
    VERMILLION,
    dress,
    finite_range,
    legend_below,
    save,
    shared_limits,
    sheet,
)

KNOWN: dict[str, dict[str, Any]] = {
    "full": {"color": BLACK, "linestyle": "-", "linewidth": 2.4},
    "Galerkin": {"color": BLUE, "linestyle": "--", "linewidth": 1.8},
    "Petrov-Galerkin": {"color": VERMILLION, "linestyle": (0, (4, 2, 1, 2)), "linewidth": 1.8},
    "analytic": {"color": GREEN, "linestyle": "", "marker": "o", "markerfacecolor": "none"},
}
REFERENCES = ("full", "analytic")  # the first one there sets the range of the axes
BEYOND = 0.8  # ranges of the reference that the axes reach past it at most
LOST = 2.0  # a curve this many heights of the panel past it is left out and named
MARKERS = 25  # of the analytic curve


@dataclasses.dataclass(frozen=True)
class Profile:
    """Curves on one line of probes at one time.

    Args:
        reynolds: Reynolds number, names the row.
        coordinate: position along the line (P,) [m].
        curves: by label, velocity norm (P,) [m/s] and pressure (P,) [Pa]. The labels `full`,
            `Galerkin`, `Petrov-Galerkin` and `analytic` have styles of their own.
        time: time of the profile [s], names the row too if given.
    """

    reynolds: float
    coordinate: np.ndarray
    curves: Mapping[str, tuple[np.ndarray, np.ndarray]]
    time: float | None = None


def centre_line_profiles(
    profiles: Sequence[Profile],
    path: str | os.PathLike[str],
    *,
    coordinate_label: str = "y on the centre line [m]",
) -> Path:
    """One row per profile: velocity norm left, pressure right.

    A curve that blew up is left out, and the panel's title says so.

    Args:
        profiles: what to draw, one row each.
        path: the file to write.
        coordinate_label: name and unit of the position along the line.
    """
    if not profiles:
        raise ValueError("profiles: got none; give one Profile per Reynolds number")
    figure = sheet(10, 2.5 * len(profiles) + 1.0)
    rows = figure.subplots(len(profiles), 2, squeeze=False, sharex="col")
    handles: dict[str, Any] = {}
    for number, (row, profile) in enumerate(zip(rows, profiles, strict=True)):
        name = f"Re = {profile.reynolds:g}"
        if profile.time is not None:
            name += f", t = {profile.time:g} s"
        for quantity, (axes, label) in enumerate(
            zip(row, ("velocity norm [m/s]", "pressure [Pa]"), strict=True)
        ):
            last = number == len(profiles) - 1
            dress(axes, coordinate_label if last else "", label, name)
            curves, lost = _draw(axes, profile, quantity)
            if lost:
                axes.set_title(f"{name} ({', '.join(lost)})", fontsize=TEXT)
            for curve in curves:
                handles.setdefault(curve.get_label(), curve)
    legend_below(figure, list(handles.values()))
    return save(figure, path)


def _draw(axes: Axes, profile: Profile, quantity: int) -> tuple[list[Any], list[str]]:
    coordinate = np.asarray(profile.coordinate)
    drawn = []
    unknown = [label for label in profile.curves if label not in KNOWN]
    for label, curve in profile.curves.items():
        value = np.asarray(curve[quantity])
        if value.shape != coordinate.shape:
            raise ValueError(
                f"profiles: curve {label!r} at Re {profile.reynolds:g} has shape {value.shape}, "
                f"its coordinate {coordinate.shape}; give one value per probe"
            )
        style = KNOWN.get(label)
        if style is None:
            color = PALETTE[(3 + unknown.index(label)) % len(PALETTE)]
            style = {"color": color, "linestyle": ":", "linewidth": 1.8}
        if style.get("marker"):
            style = style | {"markevery": max(len(coordinate) // MARKERS, 1), "markersize": 5}
        drawn += axes.plot(coordinate, value, label=label, **style)
    # `shared_limits` takes its first array for the reference.
    first = [label for label in REFERENCES if label in profile.curves]
    order = first + [label for label in profile.curves if label not in first]
    values = [np.asarray(profile.curves[label][quantity]) for label in order]
    low, high = shared_limits(values, BEYOND)
    lost = [curve for curve in drawn if _blew_up(curve.get_ydata(), low, high)]
    kept = [value for value in values if not _blew_up(value, low, high)]
    remarks = []
    for curve in lost:  # it would only hatch the panel
        why = "off the scale" if finite_range([curve.get_ydata()]) else "not finite"
        remarks.append(f"{curve.get_label()} {why}")
        curve.set_data([], [])
    low, high = shared_limits(kept, BEYOND)
    margin = 0.06 * (high - low)
    axes.set_ylim(low - margin, high + margin)
    axes.set_xlim(coordinate.min(), coordinate.max())
    return drawn, remarks


def _blew_up(value: np.ndarray, low: float, high: float) -> bool:
    found, reach = finite_range([value]), LOST * (high - low)
    return found is None or found[0] < low - reach or found[1] > high + reach
