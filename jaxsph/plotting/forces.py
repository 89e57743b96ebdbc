"""Drag and lift over time."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from ..io import ForceHistory
from .style import INK, SMALL, dress, line_style, sheet

_START = 0.1  # of a run: what comes before may leave the picture, as an impulsive start does
_ROOM = 0.08  # of the range shown, above and below


def forces_figure(histories: Mapping[str, ForceHistory]) -> Figure:
    """Drag left and lift right, the force along the first axis and the second, a curve a body.

    As coefficients where all have a reference, else in newtons. A mean over an interval is drawn
    over all of it. Both panels show the range of the run after its first tenth.

    Args:
        histories: by the bodies' names, as `jaxsph.io.read_forces` gives them; one at least, all
            with the same times.
    """
    figure = sheet(10, 3.2)
    scaled = all(np.isfinite(each.scale) for each in histories.values())
    dim = next(iter(histories.values())).force.shape[1]
    unit = "" if scaled else " [N]" if dim == 3 else " [N/m]"
    kind = "coefficient" if scaled else "force"
    averaged = any(each.averaged for each in histories.values())
    title = "means between snapshots" if averaged else "at snapshots"
    for axis, (axes, what) in enumerate(
        zip(figure.subplots(1, 2), ("drag", "lift"), strict=True)
    ):
        dress(axes, "time t [s]", f"{what} {kind}{unit}", title)
        shown = []
        for number, (name, history) in enumerate(histories.items()):
            values = history.force[:, axis] * (history.scale if scaled else 1.0)
            if history.averaged and len(values) > 1:
                values = np.concatenate([values[1:2], values[1:]])
            way = "steps-pre" if history.averaged else "default"
            style = line_style(number)
            axes.plot(history.time, values, label=name, linewidth=1.4, drawstyle=way, **style)
            since = history.time[0] + _START * np.ptp(history.time)
            shown.append(values[history.time >= since])
        low, high = np.min(np.concatenate(shown)), np.max(np.concatenate(shown))
        if np.isfinite(high - low) and high > low:
            axes.set_ylim(low - _ROOM * (high - low), high + _ROOM * (high - low))
        axes.legend(fontsize=SMALL, frameon=False, labelcolor=INK)
    return figure
