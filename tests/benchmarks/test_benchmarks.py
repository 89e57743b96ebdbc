"""Benchmarks run at a tiny size, promise the keys that figures are drawn from, and go on."""

import itertools
import json
from types import SimpleNamespace

import jax
import numpy as np
import pytest

from benchmarks import (
    convergence,
    extrapolation,
    inner_products,
    label_animation,
    paper_rom,
    right_hand_side,
    sampled_rom,
    sweep,
    tensor_rom,
    tensor_stability,
)
from benchmarks.measure import interacting_pairs, peak_memory_gib, read_json, summary, write_json
from benchmarks.references import source_paper
from jaxsph.arrangements import JitteredLattice
from jaxsph.scenes import taylor_green
from jaxsph_rom.study import PLANS


@pytest.fixture(autouse=True)
def in_empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def results(path):
    assert jax.config.jax_enable_x64  # a benchmark's precision stays its own
    read = json.loads(path.read_text())
    assert {"versions", "machine", "device"} <= read["environment"].keys()
    assert "/home" not in path.read_text()
    return read


def test_right_hand_side(tmp_path, capsys):
    path = tmp_path / "results" / "rhs.json"
    arguments = ["--particles", "150", "--h-over-dx", "2", "--precision", "float32"]
    counts = ["--repeats", "2", "--rebuild-steps", "3", "--scale", "small"]
    assert right_hand_side.main([*arguments, *counts, "--json", str(path)]) == 0
    read = results(path)
    for key in (
        "seconds", "seconds_min", "pairs", "ns_per_pair", "ns_per_pair_min", "cores_busy",
        "jvp_ratio", "vjp_ratio", "in_order_ratio", "rebuild_seconds", "rebuild_share",
        "peak_memory_gib",
    ):  # fmt: skip
        assert read[key] > 0, key
    assert read["seconds_spread"] >= 0 and 0 < read["rebuild_share"] < 1
    assert read["compile_seconds"].keys() == {
        "primal", "in order", "jvp", "vjp", "rebuild",
    }  # fmt: skip
    assert (read["particles"], read["dtype"], read["h_over_dx"]) == (144, "float32", 2.0)
    assert read["rebuild_steps"] == 4  # whole intervals of two steps
    assert 2 <= read["rebuilds"] <= 6  # at least at the start of each interval
    assert "vjp" in capsys.readouterr().out


@pytest.mark.slow
def test_convergence_is_taken_up_again(tmp_path, capsys):
    path = tmp_path / "convergence.json"
    same = ["--end-time", "0.05", "--arrangement", "lattice", "--json", str(path)]
    first = ["--resolutions", "12", "16", "--skip-without-shifting"]
    assert convergence.main([*first, *same]) == 0
    (order,) = results(path)["orders"]
    assert order["resolutions"] == [12, 16] and np.isfinite(order["velocity_error"])
    rows = results(path)["rows"]
    assert convergence.main(["--resolutions", "12", *same]) == 0
    assert "done before: resolution 12" in capsys.readouterr().err
    *kept, without_shifting = results(path)["rows"]
    assert kept == rows
    for row in rows:
        assert 0 < row["velocity_error"] < 0.1  # 2 percent at t = 0.05 s
        assert row["kinetic_energy_error"] > 0 and row["pressure_error"] > 0
        assert row["seconds"] > 0 and row["seconds_per_step"]["repeats"] == 19
        assert row["fault"] is None and row["mass_error"] < 1e-14
    # pairwise antisymmetric forces: a few rounding errors of 144 terms each
    assert not without_shifting["shifting"] and without_shifting["momentum_drift"] < 1e-14


@pytest.mark.slow
def test_reduced_models_are_taken_up_again(tmp_path, capsys):
    path = tmp_path / "rom.json"
    same = ["taylor-green", "--resolution", "12", "--end-time", "0.1", "--arrangement", "lattice"]
    same += ["--cases", "reconstructive-*-galerkin", "--json", str(path)]
    assert paper_rom.main([*same, "--modes", "2"]) == 0
    read = results(path)
    (case,) = read["cases"]
    assert case["kind"] == "reconstructive" and case["trained_on"] == [100.0]
    assert case["paper_velocity_peak_percent"] is None  # nothing is printed for M = 2
    assert case["velocity_peak_percent"] > 0 and case["rom_seconds"] > 0
    assert case["velocity_peak_percent_from_start"] == case["velocity_peak_percent"]
    energy = read["cumulative_energy_percent"]["euclidean"]
    assert 0 < energy["reference"]["2"] <= 100 and energy["paper"]["lagrangian"]["2"] == 99.9
    assert (read["particles"], read["dtype"]) == (144, "float64")
    capsys.readouterr()
    assert paper_rom.main([*same, "--modes", "2"]) == 0
    captured = capsys.readouterr()
    assert "done before: reconstructive-100-2-galerkin" in captured.err
    assert "cumulative energy" in captured.out
    assert results(path)["cases"] == [case]
    points = [word.replace("galerkin", "points") for word in same]
    assert paper_rom.main([*points, "--modes", "2", "--points"]) == 0
    on_points, first = results(path)["cases"]
    assert first == case and on_points["projection"] == "points"
    assert on_points["inner_product"] == "energy" and on_points["hyper"].startswith("tensor")
    assert 0 < on_points["velocity_peak_percent"] < 100
    assert list(results(path)["cumulative_energy_percent"]) == ["euclidean"]
    capsys.readouterr()
    assert paper_rom.main([*points, "--modes", "2", "--points"]) == 0
    assert "done before: reconstructive-100-2-points" in capsys.readouterr().err
    assert paper_rom.main([*same, "--end-time", "0.2"]) == 2
    assert "other settings" in capsys.readouterr().err


@pytest.mark.slow
def test_reduced_open_cavity_settles_first(tmp_path):
    path, out = tmp_path / "rom.json", tmp_path / "out"
    same = ["open-cavity", "--resolution", "32", "--end-time", "0.02", "--settling", "0.02"]
    same += ["--modes", "2", "--cases", "*-galerkin", "--out", str(out), "--json", str(path)]
    assert paper_rom.main(same) == 0
    read = results(path)
    (case,) = read["cases"]
    assert case["scene"] == "open-cavity" and case["reynolds"] == 2400.0
    assert read["settings"]["settling"] == 0.02 and read["parameters"]["start_time"] == 0.02
    assert (out / "settling" / "re-2400" / "trajectory.h5").exists()


@pytest.mark.parametrize("scene", source_paper.EXPERIMENTS)
def test_cases_of_the_paper(scene):
    paper = source_paper.EXPERIMENTS[scene]
    wanted = paper.wanted(paper.kinds)
    assert {(c.kind, c.reynolds, c.modes, c.projection) for c in wanted} == paper.printed.keys()
    for kind in paper.kinds.values():
        assert kind.borders == (PLANS[scene].borders if kind.reynolds[1:] else None)


def test_the_wave_of_the_moving_picture_has_two_periods():
    for point in (*label_animation.TRAINED_ON, label_animation.UNSEEN):
        assert label_animation.wave(**point).schedule.intervals == 70


def test_cases_at_a_scale():
    options = SimpleNamespace(scale="half", cases=["pred*"], modes=None, predict=None)
    kinds = paper_rom._kinds(source_paper.EXPERIMENTS["taylor-green"], options)
    every = source_paper.EXPERIMENTS["taylor-green"].wanted(kinds)
    assert {c.reynolds for c in paper_rom._wanted(every, options)} == {175.0}


def test_missing_cases_are_run_once_each():
    every = [
        source_paper.Wanted("predictive", *values)
        for values in itertools.product((125.0, 175.0), (5, 10), ("galerkin", "apg"))
    ]
    assert len(list(paper_rom._products(every))) == 1
    for count in range(len(every)):
        left = every[count:]
        runs = [
            (reynolds, modes, projection)
            for group in paper_rom._products(left)
            for reynolds, modes, projection in itertools.product(*group)
        ]
        assert sorted(runs) == sorted((c.reynolds, c.modes, c.projection) for c in left)


def test_pairs_against_all_distances():
    scene = taylor_green(12, arrangement=JitteredLattice())
    apart = np.asarray(scene.state.position)[:, None] - np.asarray(scene.state.position)
    apart -= np.round(apart)
    near = np.linalg.norm(apart, axis=-1) < scene.space.support
    assert interacting_pairs(scene.state.position, scene.space) == near.sum() - len(near)


def test_files(tmp_path):
    path = tmp_path / "folder" / "file.json"
    assert read_json(path) is None
    write_json(path, {"a": np.float64(np.nan), "b": summary([1.0, 3.0])})
    assert read_json(path)["a"] is None and read_json(path)["b"]["median"] == 2.0
    assert [p.name for p in path.parent.iterdir()] == ["file.json"]
    path.write_text("text")
    with pytest.raises(ValueError, match="not JSON"):
        read_json(path)
    assert 0.01 < peak_memory_gib() < 1000


@pytest.mark.slow
def test_tensor_models_are_taken_up_again(tmp_path, capsys):
    path = tmp_path / "tensor.json"
    same = ["--resolution", "24", "--end-time", "0.05", "--modes", "2", "--iterations", "20"]
    same += ["--predict", "175", "--json", str(path)]
    assert tensor_rom.main(same) == 0
    read = results(path)
    plain, closed = read["rows"]
    assert (plain["closure"], closed["closure"]) == ("none", "linear")
    for row in read["rows"]:
        assert row["stable"] and 0 < row["velocity_median_percent"] < 10
        assert row["velocity_peak_percent"] >= 0.5 * row["floor_velocity_peak_percent"]
        assert 0 < row["rom_seconds"]["median"] < row["fom_seconds"]
    assert read["parameters"]["arrangement"]["rule"] == "Stirred"
    assert read["parameters"]["start"] == "balanced"
    capsys.readouterr()
    assert tensor_rom.main(same) == 0
    assert results(path)["rows"] == read["rows"]
    assert tensor_rom.main([*same, "--iterations", "30"]) == 2
    assert "other settings" in capsys.readouterr().err


@pytest.mark.slow
def test_tensor_models_of_any_size_keep_their_energy(tmp_path, capsys):
    path = tmp_path / "stability.json"
    arguments = ["--resolution", "24", "--end-time", "0.05", "--modes", "3", "--json", str(path)]
    assert tensor_stability.main(arguments) == 0
    rows = results(path)["rows"]
    assert [row["modes"] for row in rows] == [1, 1, 1, 2, 2, 2, 3, 3, 3]
    for row in rows:
        assert row["stable"] and row["highest_energy_over_start"] <= 1.001
    assert "9 of 9 runs stable" in capsys.readouterr().out


@pytest.mark.slow
def test_sampled_models_come_nearer_with_more_samples(tmp_path, capsys):
    path = tmp_path / "sampled.json"
    same = ["--resolution", "16", "--end-time", "0.05", "--modes", "2", "--json", str(path)]
    assert sampled_rom.main([*same, "--samples", "30"]) == 0
    rows = results(path)["rows"]
    cases = [(row["selection"], row["wanted"]) for row in rows]
    assert cases == [
        ("tensors", None), ("all points", None), ("q-deim", 2), ("non-negative", 2),
        ("q-deim", 30), ("non-negative", 30),
    ]  # fmt: skip
    assert all(row["stable"] and row["rom_seconds"] > 0 for row in rows)
    everywhere = rows[1]["velocity_peak_percent"]
    assert rows[1]["samples"] == rows[1]["members"] == 256
    for row in rows[4:]:
        assert row["samples"] <= 30 and row["members"] <= 256
        assert row["velocity_peak_percent"] == pytest.approx(everywhere, rel=0.01)
    capsys.readouterr()
    assert sampled_rom.main([*same, "--samples", "30"]) == 0
    assert "all done before" in capsys.readouterr().err
    assert results(path)["rows"] == rows
    assert sampled_rom.main([*same, "--reynolds", "100"]) == 2


@pytest.mark.slow
def test_a_sweep_beside_single_runs_and_full_ones(tmp_path, capsys):
    path = tmp_path / "sweep.json"
    arguments = ["--resolution", "24", "--end-time", "0.05", "--members", "30", "--modes", "2"]
    arguments += ["--iterations", "20", "--judged", "175", "--json", str(path)]
    assert sweep.main(arguments) == 0
    read = results(path)
    assert read["members"] == read["stable"] == 30
    assert read["largest_difference_from_single_runs"] < 1e-12  # round-off of four steps
    assert read["sweep_seconds"]["median"] > 0 and read["single_run_seconds"]["median"] > 0
    (row,) = read["judged"]
    assert 0 < row["velocity_median_percent"] < 10 and row["stable"]
    assert row["floor_velocity_peak_percent"] > 0 and len(read["fom_seconds"]) == 5
    assert "30 Reynolds numbers, 30 stable" in capsys.readouterr().out


@pytest.mark.slow
def test_inner_products_are_taken_up_again(tmp_path, capsys):
    path = tmp_path / "products.json"
    same = ["--resolution", "16", "--end-time", "0.4", "--modes", "3", "--json", str(path)]
    assert inner_products.main(same) == 0
    read = results(path)
    assert len(read["rows"]) == 3 * 3 * 2
    keys = {tuple(row[name] for name in inner_products.KEY) for row in read["rows"]}
    assert len(keys) == len(read["rows"]) and ("energy", "mean", 5.0, 3) in keys
    energy = [row for row in read["rows"] if row["product"] == "energy"]
    assert len(energy) == 6 and all(row["stable"] for row in energy)
    for row in energy:
        assert 0 < row["velocity_median_percent"] < 20 and row["rom_seconds"]["median"] > 0
        assert 0 < row["floor_pressure_median_percent"] < 100
    capsys.readouterr()
    read["rows"].pop(8)
    write_json(path, read)
    assert inner_products.main(same) == 0
    assert "block-energy" in capsys.readouterr().out
    again = results(path)["rows"]
    assert again[:17] == read["rows"] and len(again) == 18
    assert inner_products.main([*same, "--cutoff", "7"]) == 2
    assert "other settings" in capsys.readouterr().err


@pytest.mark.slow  # half a minute; no library code of its own
def test_beyond_the_time_trained_on(tmp_path, capsys):
    path = tmp_path / "extrapolation.json"
    small = ["--resolution", "16", "--predict", "125", "--modes", "3", "--iterations", "20"]
    part = ["--end-time", "0.2", "--until", "0.1", "--out", str(tmp_path), "--json", str(path)]
    assert extrapolation.main([*small, *part]) == 0
    read = json.loads(path.read_text())
    assert [row["closure"] for row in read["rows"]] == ["none", "linear"]
    for row in read["rows"]:
        assert row["stable"]
        # both parts are judged, and beyond it is no better than its own modes allow
        assert row["beyond_error_velocity_peak_percent"] > 0.0
        assert row["trained_floor_velocity_peak_percent"] < 5.0
    assert extrapolation.main([*small, *part, "--until", "0.5"]) == 2
    assert "below the end time" in capsys.readouterr().err
