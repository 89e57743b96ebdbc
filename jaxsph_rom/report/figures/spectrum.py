"""Singular values of the snapshots in Lagrangian and in reference space."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from jaxsph.plotting.style import BLUE, INK, SMALL, VERMILLION, dress, legend_below, save, sheet

SHOWN = 60  # modes on the axis, or four times the last mark
ROUND_OFF = 1e-16  # of the largest singular value: what lies below is noise


def singular_values(
    lagrangian: np.ndarray,
    reference: np.ndarray,
    path: str | os.PathLike[str],
    *,
    marks: Sequence[int] = (2, 5, 10),
) -> Path:
    """Decay sigma_i / sigma_1 left; right, what the first M modes miss of the cumulative energy.

    The energy is the paper's, of the singular values themselves and not of their squares:
    E_M = 100 (sum_{i <= M} sigma_i) / (sum_i sigma_i) [%]. Drawn is 100 - E_M on a logarithmic
    axis, so that 99.9 and 99.999 can be told apart. The sum is over the values given.

    Args:
        lagrangian: singular values (K,) of snapshots that follow the particles, descending.
        reference: the same in reference space; it may have another length.
        path: the file to write.
        marks: mode numbers M to mark, with E_M written in the legend.
    """
    figure = sheet(10, 4.4)
    left, right = figure.subplots(1, 2)
    dress(left, "mode number i", r"singular value $\sigma_i\,/\,\sigma_1$", "decay")
    dress(right, "number of modes M", r"missing energy $100 - E_M$ [%]", "cumulative energy")
    longest = max(np.size(lagrangian), np.size(reference))
    shown_modes = min(longest, max(SHOWN, 4 * max(marks, default=0)))
    handles = []
    spaces = (
        ("Lagrangian space", lagrangian, VERMILLION, "s", "--"),
        ("reference space", reference, BLUE, "o", "-"),
    )
    for name, values, color, marker, dashes in spaces:
        sigma = _checked(name, values)
        missing = missing_energy(sigma)
        label = ", ".join(f"E{_subscript(m)} = {_energy(missing, m)}" for m in marks)
        style = {"color": color, "linestyle": dashes, "linewidth": 1.6}
        number = np.arange(1, min(sigma.size, shown_modes) + 1)
        decay = np.where(sigma > ROUND_OFF * sigma[0], sigma / sigma[0], np.nan)
        missing = np.where(missing > 0, missing, np.nan)
        at = np.array([m for m in marks if m <= sigma.size], int)
        for axes, values in ((left, decay), (right, missing)):
            (curve,) = axes.plot(number, values[: number.size], label=f"{name}: {label}", **style)
            axes.plot(at, values[at - 1], marker, color=color, markersize=6)
        handles.append(curve)
    for axes in (left, right):
        axes.set_yscale("log")
        for mark in marks:
            axes.axvline(mark, color="#8c8c8c", linewidth=0.8, linestyle=":", zorder=0)
            axes.annotate(
                f"{mark}",
                (mark, 1),
                xycoords=("data", "axes fraction"),
                xytext=(0, 1),
                textcoords="offset points",
                ha="center",
                va="bottom",
                fontsize=SMALL,
                color=INK,
            )
        axes.title.set_y(1.07)
        axes.set_xlim(0, shown_modes + 1)
    legend_below(figure, handles, columns=1)
    return save(figure, path)


def missing_energy(sigma: np.ndarray) -> np.ndarray:
    """100 - E_M for M = 1 .. K [%], (K,), summed from the tail so that it keeps its digits."""
    tail = np.concatenate([np.cumsum(sigma[::-1])[::-1][1:], [0.0]])
    return 100.0 * tail / sigma.sum()


def _checked(name: str, values: np.ndarray) -> np.ndarray:
    sigma = np.asarray(values, dtype=float)
    if sigma.ndim != 1 or not sigma.size or not np.isfinite(sigma).all() or sigma[0] <= 0:
        raise ValueError(
            f"{name}: got singular values of shape {sigma.shape}; give (K,) finite numbers, "
            "descending, the first above zero"
        )
    return sigma


def _energy(missing: np.ndarray, mark: int) -> str:
    """E_M with as many nines as it has and two digits more."""
    if mark > missing.size:
        return "-"
    lack = missing[mark - 1]
    digits = 6 if lack <= 0 else int(np.clip(np.ceil(-np.log10(lack)) + 1, 1, 8))
    return f"{100.0 - lack:.{digits}f} %"


def _subscript(number: int) -> str:
    return f"$_{{{number}}}$"
