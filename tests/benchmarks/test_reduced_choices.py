"""Benchmarks of what a reduced model may choose, at a tiny size: memory length, step size."""

import json

import jax
import numpy as np
import pytest

from benchmarks import larger_steps, memory_length, particle_modes, particle_step


@pytest.fixture(autouse=True)
def in_empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def results(path):
    assert jax.config.jax_enable_x64  # a benchmark's precision stays its own
    read = json.loads(path.read_text())
    assert {"versions", "machine", "device"} <= read["environment"].keys()
    return read


def test_a_lag_is_that_of_a_wave():
    """Between snapshots, to what a straight line between them misses."""
    time, x = np.linspace(0.0, 1.0, 61), np.linspace(0.0, 1.0, 50)[:, None, None]
    wave = lambda t: np.sin(6.0 * (x - t[None, None, :]))  # noqa: E731
    for late in (0.0243, -0.0071):
        assert particle_modes.lag(time, wave(time), wave(time - late)) == pytest.approx(
            late, abs=2e-4
        )
    assert particle_modes.lag(time, wave(0.0 * time), wave(0.0 * time)) is None


@pytest.mark.slow
def test_memory_lengths_are_taken_up_again(tmp_path, capsys):
    path = tmp_path / "memory.json"
    same = ["--resolution", "12", "--end-time", "0.05", "--modes", "2", "--json", str(path)]
    same += ["--inner-product", "energy"]
    assert memory_length.main([*same, "--constants", "0.02"]) == 0
    cases = {case["rule"]: case for case in results(path)["cases"]}
    assert list(cases) == ["galerkin", "fixed", "auto-0.02", "convective-0.02"]
    assert cases["galerkin"]["tau"] is None and cases["fixed"]["tau"] == 1e-4
    assert 0 < cases["auto-0.02"]["tau"] < cases["convective-0.02"]["tau"]
    for case in cases.values():
        assert case["stable"] and 0 < case["velocity_peak_percent"] < 10
    assert "tau / dt" in capsys.readouterr().out
    assert memory_length.main([*same, "--constants", "0.02"]) == 0
    assert "done before: energy, M = 2" in capsys.readouterr().err
    assert results(path)["cases"] == list(cases.values())
    assert memory_length.main([*same, "--end-time", "0.1"]) == 2
    assert "other settings" in capsys.readouterr().err


@pytest.mark.slow
def test_larger_steps(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(larger_steps, "SOLVERS", {
        name: larger_steps.SOLVERS[name] for name in ("tsit5", "kvaerno3")
    })  # fmt: skip
    monkeypatch.setattr(larger_steps, "TOLERANCES", (1e-3, 1e-6))
    path = tmp_path / "steps.json"
    same = ["--resolution", "24", "--end-time", "0.05", "--factors", "1", "2", "--modes", "2"]
    same += ["--json", str(path)]
    assert larger_steps.main(same) == 0
    rows = results(path)["rows"]
    assert [(r["method"], r["factor"] or r["tolerance"]) for r in rows] == [
        ("rk4", 1), ("rk4", 2),
        ("tsit5", 1e-3), ("tsit5", 1e-6), ("kvaerno3", 1e-3), ("kvaerno3", 1e-6),
    ]  # fmt: skip
    for row in rows:
        assert row["stable"] and 0 < row["seconds"]["median"] < row["compile_seconds"]
        assert 0 < row["error"] < 0.01 and np.isfinite(row["pressure_peak_percent"])
        # stages of a step, and of the guess at the first one; implicit ones iterate
        assert (
            row["evaluations"]
            >= {"rk4": 4, "tsit5": 6, "kvaerno3": 3}[row["method"]] * (row["steps"])
        )
    assert rows[0]["evaluations"] == 4 * rows[0]["steps"] == 2 * rows[1]["evaluations"]
    # in so short a run both tolerances may take the same steps
    assert rows[1]["error"] > rows[0]["error"] and rows[2]["error"] >= rows[3]["error"]
    assert "tolerance" in capsys.readouterr().out
    assert larger_steps.main(same) == 0
    assert "all done before" in capsys.readouterr().err and results(path)["rows"] == rows
    assert larger_steps.main([*same, "--factors", "3"]) == 2
    assert "other settings" in capsys.readouterr().err


@pytest.mark.slow
def test_any_number_of_modes_on_particles_is_taken_up_again(tmp_path, capsys):
    path = tmp_path / "modes.json"
    same = ["--resolution", "16", "--end-time", "0.34", "--arrangements", "lattice"]
    same += ["--json", str(path), "--out", str(tmp_path)]
    assert particle_modes.main([*same, "--modes", "2"]) == 0
    first = results(path)["rows"]
    assert particle_modes.main([*same, "--modes", "2", "4", "--projections", "apg"]) == 0
    rows = results(path)["rows"]
    assert rows[:1] == first
    made = [(r["modes"], r["projection"]) for r in rows]
    assert made == [(2, "galerkin"), (2, "apg"), (4, "apg")]
    for row in rows:
        assert row["stable"] and row["doubt"] is None and row["judged"] is None
        assert row["interpolation"] == "polynomials"  # on a lattice
        assert 0 < row["slow_pressure_peak_percent"] < row["pressure_peak_percent"]
        assert row["sound_peak_percent"] > 0
        assert 0 < row["floor_velocity_peak_percent"] < 1.0 and row["velocity_peak_percent"] < 1.0
        assert 0 < row["level_peak_percent"] < row["fluctuation_peak_percent"] < 10.0
    assert "apg" in capsys.readouterr().out
    assert particle_modes.main([*same, "--cutoff", "3"]) == 2


@pytest.mark.slow
def test_a_step_on_particles_is_timed_beside_the_full_models(tmp_path, capsys):
    path = tmp_path / "step.json"
    same = ["--scenes", "taylor-green", "--resolution", "16", "--modes", "3", "--repeats", "2"]
    for projections in (["galerkin"], ["galerkin", "apg"]):  # what is timed again is replaced
        assert particle_step.main([*same, "--json", str(path), "--projections", *projections]) == 0
    rows = results(path)["rows"]
    assert [(row["modes"], row["projection"]) for row in rows] == [(3, "galerkin"), (3, "apg")]
    for row in rows:
        seconds, full = row["process_seconds"]["median"], row["full_process_seconds"]["median"]
        assert row["particles"] == 256 and row["process_ratio"] == pytest.approx(seconds / full)
    assert "reduced [ms]" in capsys.readouterr().out
