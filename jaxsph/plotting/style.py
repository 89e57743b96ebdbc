"""What all figures share: sheet, colours, legend and ranges.

The figures are matplotlib `Figure` objects of their own: they touch no pyplot state, need no
display and do not depend on the user's matplotlib settings for colours and letter sizes.
"""

from __future__ import annotations

import io
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backend_bases import FigureCanvasBase
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

INK = "#1a1a1a"
FAINT = "#d9d9d9"
WALL = "#9a9a9a"
# Okabe and Ito (2008), without the yellow, which is too faint for lines on white.
BLACK, BLUE, VERMILLION, GREEN = "#000000", "#0072B2", "#D55E00", "#009E73"
PURPLE, ORANGE, SKY = "#CC79A7", "#E69F00", "#56B4E9"
PALETTE = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, BLACK)
DASHES = ("-", "--", "-.", ":")
MAGNITUDE_MAP, SIGNED_MAP = "viridis", "RdBu_r"
TEXT, SMALL = 10, 8.5  # points
RESOLUTION = 150  # dots per inch


def sheet(width: float, height: float, layout: str = "constrained") -> Figure:
    """An empty white figure, width by height inches, that lays itself out.

    The layout `compressed` is for panels of equal aspect.
    """
    figure = Figure(figsize=(width, height), layout=layout, facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def save(figure: Figure, path: str | os.PathLike[str]) -> Path:
    """Write the figure, the format by the path's ending, and return the path.

    Raises:
        ValueError: if there is no such format.
    """
    path = Path(path)
    check_ending(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=RESOLUTION, facecolor="white", bbox_inches="tight", pad_inches=0.1)
    return path


def check_ending(path: Path) -> None:
    """A ValueError if no figure can be written with a path's ending."""
    known = FigureCanvasBase.get_supported_filetypes()
    if path.suffix.lower().removeprefix(".") not in known:
        raise ValueError(f"{path}: figures end with .png, .pdf or .svg; name it so.")


def png(figure: Figure) -> bytes:
    """The figure as PNG, for a page that holds it."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=RESOLUTION, facecolor="white")
    return stream.getvalue()


def dress(axes: Axes, xlabel: str = "", ylabel: str = "", title: str = "") -> None:
    """Dark labels with units on white, a faint grid behind the data, no frame above and right."""
    axes.set_facecolor("white")
    axes.set_axisbelow(True)
    axes.grid(True, which="major", color=FAINT, linewidth=0.6, linestyle="-")
    axes.tick_params(which="both", colors=INK, labelsize=SMALL)
    for side, spine in axes.spines.items():
        spine.set(visible=side in ("left", "bottom"), color=INK, linewidth=0.8)
    axes.set_xlabel(xlabel, color=INK, fontsize=TEXT)
    axes.set_ylabel(ylabel, color=INK, fontsize=TEXT)
    axes.set_title(title, color=INK, fontsize=TEXT)


def legend_below(figure: Figure, handles: Sequence[Any], columns: int | None = None) -> None:
    """A legend under all panels, in as many columns as its longest label leaves room for.

    The sheet grows by the rows of the legend, so that the panels keep their height.
    """
    if not handles:
        return
    longest = max(len(handle.get_label()) for handle in handles)
    room = max(int(figure.get_figwidth() * 72 / ((longest + 7) * 0.58 * SMALL)), 1)
    columns = min(columns or len(handles), room, len(handles))
    rows = -(-len(handles) // columns)
    figure.set_figheight(figure.get_figheight() + (rows - 1) * 1.6 * SMALL / 72)
    figure.legend(
        handles=handles,
        loc="outside lower center",
        ncols=columns,
        fontsize=SMALL,
        labelcolor=INK,
        frameon=False,
        handlelength=2.6,
    )


def line_style(number: int) -> dict[str, Any]:
    """Colour and dashes of curve `number` = 0, 1, ...; pairs repeat after 28."""
    lap = number // len(PALETTE)
    return {"color": PALETTE[number % len(PALETTE)], "linestyle": DASHES[lap % len(DASHES)]}


def finite_range(values: Iterable[np.ndarray]) -> tuple[float, float] | None:
    """Least and largest finite number in the arrays; None where there is none."""
    kept = [array[np.isfinite(array)] for array in map(np.asarray, values)]
    kept = [array for array in kept if array.size]
    if not kept:
        return None
    return float(min(map(np.min, kept))), float(max(map(np.max, kept)))


def shared_limits(values: Sequence[np.ndarray], beyond: float) -> tuple[float, float]:
    """Limits that hold all values, but let a run that blew up not squash the others.

    The first array with finite values is the reference; limits go `beyond` of its ranges past it
    at most.
    """
    ranges = [finite_range([array]) for array in values]
    known = [pair for pair in ranges if pair is not None]
    if not known:
        return 0.0, 1.0
    low, high = known[0]
    span = (high - low) or abs(high) or 1.0
    least, largest = min(pair[0] for pair in known), max(pair[1] for pair in known)
    low, high = max(least, low - beyond * span), min(largest, high + beyond * span)
    return (low, high) if high > low else (low - 0.5 * span, high + 0.5 * span)
