"""Benchmarks of walls at a tiny size: what they measure, and that they go on where cut short."""

import json

import numpy as np
import pytest

from benchmarks import (
    cavity_options,
    lid_driven_cavity,
    open_cavity,
    plane_flows,
    viscous_sum,
    wall_cost,
    walled_rom,
)
from benchmarks.centre_lines import centre_line_errors, published
from benchmarks.references.lid_driven_cavity import LIDS, solve


@pytest.fixture(autouse=True)
def in_empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_plane_flows_are_taken_up_again(tmp_path, capsys):
    path = tmp_path / "plane.json"
    arguments = ["--flows", "poiseuille", "--resolutions", "12", "--json", str(path)]
    assert plane_flows.main(arguments) == 0
    read = json.loads(path.read_text())
    (row,) = read["rows"]
    assert 0 < row["velocity_error_percent"] < 6  # 3 percent with twelve particles across
    assert 0.1 < row["nearest_to_wall_over_dx"] <= 0.5 and row["seconds"] > 0
    capsys.readouterr()
    assert plane_flows.main(arguments) == 0
    assert "poiseuille" in capsys.readouterr().out
    assert json.loads(path.read_text())["rows"] == [row]


def test_wall_cost(tmp_path, capsys):
    path = tmp_path / "cost.json"
    assert wall_cost.main(["--sides", "16", "--repeats", "2", "--json", str(path)]) == 0
    (row,) = json.loads(path.read_text())["rows"]
    assert row["ghosts"] == 24**2 - 16**2 - 4 * 3  # four layers, but for the corners' outer ghosts
    assert row["ratio_per_fluid_particle"] > 0
    assert row["ratio_per_particle_and_ghost"] < row["ratio_per_fluid_particle"]
    assert "walled ms" in capsys.readouterr().out


@pytest.mark.slow
def test_the_viscous_sum_on_a_lattice(tmp_path):
    path = tmp_path / "sum.json"
    arguments = ["--resolutions", "32", "--h-over-dx", "2", "--json", str(path)]
    assert viscous_sum.main(arguments) == 0
    rows = {row["start"]: row for row in json.loads(path.read_text())["rows"]}
    # 8 sum_j (y^2 / 2) x^2 / r^2 (-W' / r) dx^2 over an unbounded lattice is 0.9592, for waves less
    # by the kernel's smoothing, 1 percent at this resolution
    assert rows["lattice"]["shear_ratio"] == pytest.approx(0.9592, abs=0.01)
    # 3.0376 - 2 0.9592 + 0.9592 over 2 for the vortex, 1.039 but for the smoothing
    assert rows["lattice"]["taylor_green_ratio"] == pytest.approx(1.039, abs=0.02)
    jittered = rows["jittered 0.25"]
    assert abs(jittered["shear_ratio"] - 1.0) < abs(rows["lattice"]["shear_ratio"] - 1.0)


def test_misprints_of_the_tables_do_not_count():
    assert np.isnan(published("v", 400)).sum() == 1 and np.isfinite(published("u", 400)).all()


def test_centre_lines_of_the_exact_flow_are_right():
    side = (np.arange(50) + 0.5) / 50
    points = np.stack(np.meshgrid(side, side, indexing="ij"), axis=-1).reshape(-1, 2)
    time = np.linspace(0.0, 2.0, 11)
    exact = solve(100, LIDS["constant"]).velocity(points)
    still = [np.broadcast_to(values, (11, *values.shape)) for values in (points, exact)]
    found = centre_line_errors(time, *still, 1.0 / 50, 100, "constant")
    assert max(found["u_error_percent"], found["v_error_percent"]) < 0.3  # the probe's own error
    assert found["change_percent"] < 1e-10 and found["change_over_seconds"] == 1.0
    late = centre_line_errors(time, still[0], 1.1 * still[1], 1.0 / 50, 100, "constant")
    assert late["u_error_percent"] > 5.0


def test_cases_of_the_cavity_have_whole_intervals():
    for name, cases in lid_driven_cavity.SETS.items():
        for values in cases:
            case = dict(zip(lid_driven_cavity.KEY, values, strict=True))
            if case["resolution"] < 100:  # a big one only takes longer
                scene = lid_driven_cavity.make_scene(case)
                every = scene.time_step * scene.steps_per_snapshot
                assert scene.steps * scene.time_step == pytest.approx(case["end_time"]), name
                assert every == pytest.approx(0.2)


@pytest.mark.slow
def test_open_cavity(tmp_path, capsys):
    path = tmp_path / "open.json"
    arguments = ["--resolution", "24", "--end-time", "0.2", "--json", str(path)]
    assert open_cavity.main(arguments) == 0
    read = json.loads(path.read_text())
    assert 0.1 < read["bulk_velocity"] < 1.0  # the kick's impulse is 0.5 m/s over the channel
    ratio = read["measured_reynolds"] / read["nominal_reynolds"]
    assert ratio == pytest.approx(read["bulk_velocity"] / 0.43)
    assert read["beyond_wall"] == 0 and len(read["time"]) == len(read["mouth_velocity_over_time"])
    assert read["energy_change_in_last_second_percent"] is None  # there is no second before
    assert "Reynolds number" in capsys.readouterr().out


def test_frequency_and_settling_of_a_known_signal():
    time = np.linspace(0.0, 10.0, 501)
    signal = 0.3 - 0.01 * time + 0.2 * np.sin(2 * np.pi * 1.37 * time)
    assert open_cavity.dominant_frequency(time, signal) == pytest.approx(1.37, abs=0.01)
    slow = np.sin(2 * np.pi * 0.1 * time)  # one period: not to be told from a trend
    assert open_cavity.dominant_frequency(time, slow) is None
    # exp(-t) + 1: over a period P the mean changes by exp(-t) (1 - exp(-P))^2 / P
    energy, period = np.exp(-time) + 1.0, 0.5
    found = open_cavity.settling_time(time, energy, 1.0 / period, 0.01)
    assert found == pytest.approx(-np.log(0.01 * period / (1.0 - np.exp(-period)) ** 2), abs=0.1)
    assert open_cavity.settling_time(time, energy, None, 0.01) is None
    assert open_cavity.settling_time(time, np.exp(time), 1.0 / period, 0.01) is None


def test_the_trend_of_a_decay():
    time = np.linspace(0.0, 2.0, 101)
    values = 3.0 * np.exp(-0.07 * time) * (1.0 + 0.01 * np.sin(2 * np.pi * 5.0 * time))
    assert open_cavity.trend(time, values) == pytest.approx(-0.07, rel=0.05)


@pytest.mark.slow
def test_options_of_the_reduced_cavity(tmp_path, capsys):
    path = tmp_path / "options.json"
    arguments = ["--resolution", "14", "--end-time", "0.2", "--modes", "2",
                 "--out", str(tmp_path / "runs"), "--json", str(path)]  # fmt: skip
    assert cavity_options.main(arguments) == 0
    rows = json.loads(path.read_text())["rows"]
    assert len({(r["inner_product"], r["advection"], r["map"]) for r in rows}) == len(rows) == 8
    assert all(0.0 < row["lasted"] <= 0.2 and row["velocity_peak_percent"] > 0.0 for row in rows)
    assert "MovingLeastSquaresMap" in capsys.readouterr().out


@pytest.mark.slow
def test_reduced_models_between_walls_beside_the_sound_of_the_full_one(tmp_path, capsys):
    path = tmp_path / "walled.json"
    arguments = ["lid-driven-cavity", "--resolution", "14", "--end-time", "1.2", "--from", "0.5",
                 "--train", "50", "100", "--predict", "75", "--modes", "3", "--closures", "none",
                 "--formulations", "solenoidal", "--json", str(path)]  # fmt: skip
    assert walled_rom.main(arguments) == 0
    (row,) = rows = json.loads(path.read_text())["rows"]
    assert row["stable"] and row["predicted"] and row["rom_seconds"]["median"] > 0
    assert 0 < row["floor_velocity_on_points_median_percent"] < 1
    assert 0 < row["sound_on_points_peak_percent"] < 200
    assert row["velocity_on_line_start_peak_percent"] > 0
    capsys.readouterr()
    assert walled_rom.main(arguments) == 0
    assert json.loads(path.read_text())["rows"] == rows
