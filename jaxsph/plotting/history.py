"""Kinetic energy and density of a run over time."""

from __future__ import annotations

from matplotlib.figure import Figure

from ..history import History
from .style import BLUE, SMALL, VERMILLION, dress, sheet


def history_figure(history: History, energy_unit: str) -> Figure:
    """Kinetic energy left, the lowest and the highest density of a particle right.

    Args:
        history: of the run.
        energy_unit: J, or J/m in two dimensions.
    """
    figure = sheet(10, 3.2)
    energy, density = figure.subplots(1, 2)
    dress(energy, "time t [s]", f"kinetic energy [{energy_unit}]", "all particles")
    energy.plot(history.time, history.kinetic_energy, color=BLUE, linewidth=1.6)
    energy.set_ylim(bottom=0.0)
    dress(density, "time t [s]", "density [kg/m$^3$]", "extremes over the particles")
    for name, values, color, line in (
        ("highest", history.highest_density, VERMILLION, "--"),
        ("lowest", history.lowest_density, BLUE, "-"),
    ):
        density.plot(history.time, values, line, color=color, linewidth=1.6, label=name)
    density.legend(fontsize=SMALL, frameon=False)
    return figure
