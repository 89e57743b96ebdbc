"""Drag of the cylinder in a channel: its rows, and what they are made of."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks import channel_cylinder as benchmark
from jaxsph.scenes import channel_cylinder
from jaxsph.scenes.channel_cylinder import HEIGHT, MEAN


def test_pressure_and_flux_of_a_known_flow():
    scene = channel_cylinder(33, end_time=0.02)
    position = np.asarray(scene.state.position)
    known = SimpleNamespace(
        position=position[None],
        velocity=np.full((1, *position.shape), [1.02 * MEAN, 0.0]),
        pressure=(3.0 - 2.0 * position[:, 0])[None],
        active=None,
    )
    late = np.array([True])
    # linear fields are exact
    found = benchmark.pressure_difference(scene.space, known, late)
    assert found == pytest.approx(2.0 * 0.1, rel=1e-9)
    # a section holds its whole columns and a part of one more; the cylinder takes a tenth of one
    mass = float(scene.mass)
    assert benchmark.flux_off(mass, known, late) == pytest.approx(0.1, abs=0.06)
    lengths = scene.space.box.lengths
    held = mass * len(position) / (lengths[0] * HEIGHT)
    assert held == pytest.approx(1.0, abs=0.01)


@pytest.mark.slow
def test_rows_are_told_and_kept(tmp_path, capsys):
    path = tmp_path / "rows.json"
    assert benchmark.main(["--resolutions", "33", "--t-end", "0.05", "--json", str(path)]) == 0
    (row,) = json.loads(path.read_text())["rows"]
    assert row["drag"] > 0.0 and np.isfinite(row["pressure_difference"])
    assert 0.0 < row["mass_flux_off_percent"] < 20.0
    assert "dp [Pa]" in capsys.readouterr().out
