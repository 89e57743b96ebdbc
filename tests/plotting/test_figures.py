"""Figures of a run: what is drawn is what the file holds."""

import numpy as np
import pytest

from jaxsph.history import read_history
from jaxsph.io import read_snapshot
from jaxsph.plotting import FIELDS, depth_figure, history_figure, save, snapshot_figure, vorticity
from jaxsph.plotting.particles import middle_layer
from tests.runs import random_run


def test_snapshot(tmp_path):
    time, snapshot = read_snapshot(random_run(tmp_path / "t.h5"), 2)
    figure = snapshot_figure(time, snapshot, tuple(FIELDS.values()))
    panels = [axes for axes in figure.axes if axes.get_title()]
    values = [np.linalg.norm(snapshot.velocity, axis=1), snapshot.pressure, snapshot.density,
              vorticity(snapshot.position, snapshot.velocity)]  # fmt: skip
    for axes, value in zip(panels, values, strict=True):
        (squares,) = axes.collections
        np.testing.assert_array_equal(squares.get_offsets(), snapshot.position)
        np.testing.assert_array_equal(squares.get_array(), value)
        assert axes.get_title() == f"t = {time:.4g} s" and axes.get_xlabel() == "x [m]"
    labels = [axes.get_ylabel() for axes in figure.axes if axes not in panels]
    assert labels == [field.label for field in FIELDS.values()]
    low, high = panels[1].collections[0].get_clim()
    assert low == -high  # pressure has both signs
    assert save(figure, tmp_path / "f.png").stat().st_size > 1000


def test_history(tmp_path):
    history = read_history(random_run(tmp_path / "t.h5"), 256, 1.0)
    energy, density = history_figure(history, "J/m").axes
    assert energy.get_ylabel() == "kinetic energy [J/m]"
    np.testing.assert_array_equal(energy.lines[0].get_ydata(), history.kinetic_energy)
    assert [line.get_label() for line in density.lines] == ["highest", "lowest"]
    np.testing.assert_array_equal(density.lines[1].get_ydata(), history.lowest_density)


@pytest.mark.parametrize("layers", [8, 9])
def test_of_three_dimensions_one_layer_is_drawn(layers):
    line = (np.arange(layers) + 0.5) / layers
    lattice = np.stack(np.meshgrid(line, line, line), axis=-1).reshape(-1, 3)
    shown = middle_layer(lattice)
    assert shown.sum() == layers**2 and len(set(lattice[shown, 2])) == 1
    assert abs(lattice[shown, 2][0] - 0.5) <= 0.5 / layers + 1e-12
    assert middle_layer(lattice[:, :2]).all()


def test_one_value_only_has_colours_too():
    low, high = FIELDS["velocity"].colours(0.0, 0.0)[1]
    assert low < 0.0 < high
    assert FIELDS["pressure"].colours(-2.0, 1.0)[1] == (-2.0, 2.0)
    assert FIELDS["pressure"].colours(1.0, 2.0)[1] == (1.0, 2.0)
    assert FIELDS["pressure"].colours(-1.0, 20.0) == ("viridis", (-1.0, 20.0))


def test_points_by_depth(tmp_path):
    time, snapshot = read_snapshot(random_run(tmp_path / "t.h5", dim=3))
    figure = depth_figure(time, snapshot)
    (points,) = figure.axes[0].collections
    speed = np.linalg.norm(snapshot.velocity, axis=1)
    shown = points.get_array()
    assert len(shown) == round(0.25 * len(speed)) and shown.min() >= np.quantile(speed, 0.74)
    assert save(figure, tmp_path / "f.png").stat().st_size > 1000
    flat = read_snapshot(random_run(tmp_path / "flat.h5"))
    with pytest.raises(ValueError, match="have a depth"):
        depth_figure(*flat)
