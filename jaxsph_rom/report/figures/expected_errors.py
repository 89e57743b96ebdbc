"""What error a prediction is to be expected to have, over a parameter."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from jaxsph.plotting.style import BLUE, FAINT, SMALL, VERMILLION, dress, sheet


def expected_errors(
    name: str, values: np.ndarray, percent: np.ndarray, trained: np.ndarray
) -> Figure:
    """Expected error over a parameter, with the range that is trained on shaded.

    Args:
        name: of the parameter, for the axis.
        values: of the members (K,).
        percent: expected error of their velocity [%] (K,); NaN where there is none.
        trained: values that the model was trained on (R,).
    """
    figure = sheet(6.5, 3.2)
    axes = figure.subplots()
    dress(axes, name, "expected error of velocity [%]")
    axes.axvspan(trained.min(), trained.max(), color=FAINT, alpha=0.5, zorder=0)
    order = np.argsort(values)
    axes.plot(values[order], percent[order], "." if len(values) < 50 else "-", color=BLUE)
    axes.plot(trained, np.zeros(len(trained)), "|", color=VERMILLION, markersize=12,
              markeredgewidth=2, label="trained on", clip_on=False)  # fmt: skip
    axes.set_ylim(bottom=0.0)
    axes.legend(fontsize=SMALL, frameon=False)
    return figure
