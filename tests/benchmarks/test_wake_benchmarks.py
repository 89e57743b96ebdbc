"""What is told of a cylinder's wake."""

import json

import numpy as np
import pytest

from benchmarks import cylinder_wake, drag_slopes
from benchmarks.wake_models import beside
from benchmarks.wake_runs import harmonic, onset


def test_lift_is_taken_for_the_sine_that_it_is():
    time = np.arange(0.3, 40.0, 0.3)
    angle = 2.0 * np.pi * 0.173 * time + 0.4
    drag = 1.4 + 0.01 * np.sin(2.0 * angle)
    noise = 0.05 * np.random.default_rng(0).normal(size=len(time))
    found = harmonic(time, drag, 0.02 + 0.33 * np.sin(angle) + noise)
    assert found["strouhal"] == pytest.approx(0.173, rel=2e-3)
    assert found["lift_amplitude"] == pytest.approx(0.33, rel=0.05)
    assert found["drag"] == pytest.approx(1.4, rel=2e-3)
    assert found["lift_left_rms"] == pytest.approx(0.05, rel=0.2)
    turned = (found["phase"] - angle[-1] + np.pi) % (2.0 * np.pi) - np.pi
    assert abs(turned) < 0.1


def test_a_wake_sheds_from_when_lift_is_half_as_strong_as_at_last():
    time = np.arange(0.3, 75.0, 0.3)
    angle = 2.0 * np.pi * 0.173 * time
    noise = 0.02 * np.random.default_rng(0).normal(size=len(time))
    lift = 0.3 / (1.0 + np.exp(-(time - 30.0) / 2.0)) * np.sin(angle) + noise
    assert onset(time, lift) == pytest.approx(30.0, abs=1.0)
    assert onset(time, 0.3 * np.sin(angle)) == 0.0
    assert onset(time, 0.3 * np.exp(-((time / 70.0) ** 20)) * np.sin(angle)) is None  # it has died


def test_a_wake_beside_another_is_off_by_shares_and_by_a_part_of_a_period():
    true = {"strouhal": 0.2, "drag": 1.5, "lift_amplitude": 0.3, "phase": 0.1}
    wave = {"strouhal": 0.201, "drag": 1.47, "lift_amplitude": 0.33, "phase": 0.1 - 0.2 * np.pi}
    found = beside(wave, true)
    assert found["strouhal_error_percent"] == pytest.approx(0.5)
    assert found["drag_error_percent"] == pytest.approx(2.0)
    assert found["lift_error_percent"] == pytest.approx(10.0)
    assert found["phase_error_percent_of_a_period"] == pytest.approx(10.0)
    assert "onset" not in found


@pytest.mark.slow
def test_a_short_run_is_judged_and_kept(tmp_path):
    file, command = tmp_path / "wake.json", ["--widths", "2.5", "--json"]
    command.append(str(file))
    assert cylinder_wake.main(["--reynolds", "20", "--t-end", "0.6", *command]) == 0
    assert cylinder_wake.main(["--reynolds", "60", "--t-end", "6", *command]) == 0
    steady, shedding = json.loads(file.read_text())["rows"]
    assert steady["drag"] > 1.0 and "wake_length" in steady
    assert shedding["drag"] > 1.0 and "strouhal" in shedding
    assert cylinder_wake.main(["--reynolds", "60", "--t-end", "6", *command]) == 0
    assert json.loads(file.read_text())["rows"] == [steady, shedding]  # nothing was left to run


def test_a_run_too_short_to_see_lift_swing_is_refused(tmp_path, capsys):
    file = tmp_path / "wake.json"
    assert cylinder_wake.main(["--reynolds", "60", "--t-end", "1", "--json", str(file)]) == 2
    assert "--t-end: at least 6 s" in capsys.readouterr().err
    assert not file.exists()


@pytest.mark.slow
@pytest.mark.run_once
def test_slopes_of_mean_drag_are_those_of_differences(tmp_path):
    """In the viscosity and in the speed of the inflow, through the full model."""
    file = tmp_path / "slopes.json"
    assert drag_slopes.main(["--seconds", "0.2", "--json", str(file)]) == 0
    (row,) = json.loads(file.read_text())["rows"]
    assert row["steps"] == 13 and row["drag"] > 1.0
    assert row["list_built_anew_changes_it_by"] < 1e-12  # the list is no part of the slope
    for slope in row["slopes"]:
        assert slope["forward_deviation"] < 1e-10
        off = slope["deviation_by_difference"]
        # second order in the share, round-off of drag over it: 1e-9 each, with room
        assert max(off["1e-05"], off["1e-06"]) < 1e-7, slope
    assert {slope["parameter"] for slope in row["slopes"]} == {"viscosity", "speed"}
