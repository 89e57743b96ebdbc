"""`jaxsph-rom run`: results, resuming, and one clear line for bad input."""

import json
import math
import re

import pytest

from jaxsph.cli.options import bytes_told
from jaxsph_rom import ConvectiveMemory, SpectralMemory, load
from jaxsph_rom.cli import main
from jaxsph_rom.cli.run import memory_length
from jaxsph_rom.report import Case, verdict
from tests.pages import checked_page

SMALL = ["run", "taylor-green", "--resolution", "16", "--t-end", "0.06", "--arrangement", "lattice",
         "--hyper", "none"]  # fmt: skip
KEYS = {
    "scene", "reynolds", "modes", "projection", "tau", "inner_product", "hyper", "trained_on",
    "velocity_peak_percent", "velocity_median_percent", "pressure_peak_percent",
    "pressure_median_percent", "stable", "fom_seconds", "rom_seconds", "fom_steps", "rom_steps",
}  # fmt: skip


def test_a_study_from_one_line(tmp_path, capsys):
    arguments = [*SMALL, "--train", "100", "200", "--predict", "150", "--modes", "1",
                 "--projection", "galerkin", "apg", "--out", str(tmp_path)]  # fmt: skip
    assert main(arguments) == 0
    report = json.loads((tmp_path / "report.json").read_text())
    assert [case["projection"] for case in report["cases"]] == ["galerkin", "apg"]
    for case in report["cases"]:
        assert case.keys() >= KEYS
        assert case["stable"] and case["trained_on"] == [100.0, 200.0]
        assert 0 < case["velocity_median_percent"] < 5  # ten steps of a slow decay
        assert case["rom_seconds"] > 0 and case["fom_seconds"] > 0
    assert report["environment"]["versions"]["jax"]
    energies = report["bases"][0]["cumulative_energy_percent"]
    assert energies["reference"]["2"] <= 100.0 and energies["lagrangian"]["2"] <= 100.0
    figures = {path.stem for path in tmp_path.glob("*.png")}
    assert figures == {
        "singular_values", "modes", "discrepancy", "centre_line", "fields_re_150",
        "differences_re_150",
    }  # fmt: skip
    table = capsys.readouterr().out
    assert "150" in table and "galerkin" in table
    page = checked_page(tmp_path / "report.html")
    assert len(page.figures) == len(figures)
    assert set(page.figures) == {path.read_bytes() for path in tmp_path.glob("*.png")}
    for line in table.splitlines()[4:6]:  # each row of the table, a cell for a cell
        words = line.split()
        start = page.cells.index(words[3]) - 3
        assert page.cells[start : start + len(words)] == words
    for word in ("reduced [s]", "velocity peak %", "energy inner product", "jaxlib", "cores"):
        assert word in page.text

    # the same line again computes nothing anew
    stamps = {p: p.stat().st_mtime_ns for p in tmp_path.rglob("*.h5")}
    assert len(stamps) == 5
    assert main(arguments) == 0
    assert stamps == {p: p.stat().st_mtime_ns for p in tmp_path.rglob("*.h5")}


@pytest.mark.parametrize(
    "arguments, word",
    [
        (["run", "no-such-scene"], "no-such-scene"),
        ([*SMALL, "--train", "-5"], "--train"),
        ([*SMALL, "--predict", "0"], "--predict"),
        ([*SMALL, "--modes", "0"], "--modes"),
        ([*SMALL, "--modes", "5000"], "5000"),
        ([*SMALL, "--interpolation", "polynomials", "--spline-order", "2"], "need an odd one"),
        (
            [
                "run",
                "open-cavity",
                "--interpolation",
                "polynomials",
                "--settling",
                "0.01",
                "--resolution",
                "32",
            ],
            "a lattice that fills the box",
        ),
        ([*SMALL, "--h-over-dx", "9"], "too small"),
        ([*SMALL, "--time-step", "1"], "stability limit"),
        ([*SMALL, "--scheme", "consistent", "--advection", "paper"], "take ModeAdvection()"),
        ([*SMALL, "--tau", "x"], "--tau: a time in s, auto or convective, got 'x'"),
        ([*SMALL, "--tau", "-1"], "--tau: a time in s"),
        (["run", "taylor-green", "--scale", "vast"], "vast"),
        ([*SMALL, "--hyper", "tensor", "--closure", "linear", "--held-back", "120"], "Re 120"),
        (["run", "open-cavity", "--hyper", "tensor", "--settling", "0.01"], "KickAndHold"),
    ],
)
def test_bad_input_is_one_line_and_code_2(tmp_path, capsys, arguments, word):
    out = tmp_path / "out"
    assert main([*arguments, "--out", str(out)]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and word in error
    assert not out.exists()


@pytest.mark.slow
def test_pressure_that_is_uniform_at_the_start_has_a_measure_and_a_verdict(tmp_path, capsys):
    arguments = ["run", "shear-layer", "--resolution", "16", "--train", "100", "200", "--predict",
                 "150", "--modes", "3", "--t-end", "0.1", "--hyper", "tensor",
                 "--out", str(tmp_path)]  # fmt: skip
    assert main(arguments) == 0
    (case,) = json.loads((tmp_path / "report.json").read_text())["cases"]
    assert case["stable"] and case["fault"] is None
    for name in ("velocity", "pressure"):
        assert 0.0 < case[f"{name}_median_percent"] <= case[f"{name}_peak_percent"] < 100.0


def test_the_papers_model_is_one_word_away(tmp_path):
    arguments = ["run", "taylor-green", "--resolution", "12", "--t-end", "0.02", "--train", "100",
                 "--predict", "100", "--modes", "2", "--arrangement", "lattice",
                 "--hyper", "none"]  # fmt: skip
    choices = {}
    for name, more in (("best", []), ("paper", ["--faithful"]),
                       ("mixed", ["--faithful", "--map", "mls", "--gauge"])):  # fmt: skip
        assert main([*arguments, *more, "--out", str(tmp_path / name)]) == 0
        report = json.loads((tmp_path / name / "report.json").read_text())
        (case,) = report["cases"]
        choices[name] = case["inner_product"], report["advection"], report["map"]
    assert choices == {
        "best": ("energy", "modes", "QuadraticMap"),
        "paper": ("euclidean", "paper", "ShepardMap"),
        "mixed": ("euclidean", "paper-gauged", "MovingLeastSquaresMap"),
    }


def test_a_memory_length_is_a_time_or_a_rule():
    assert memory_length("1e-4") == 1e-4 and memory_length("auto") == SpectralMemory()
    assert memory_length("convective") == ConvectiveMemory()


@pytest.mark.slow
def test_models_on_reference_points_beside_those_on_particles(tmp_path, capsys):
    arguments = ["run", "taylor-green", "--resolution", "16", "--t-end", "0.06", "--hyper", "none",
                 "tensor", "--train", "100", "200", "--predict", "150", "--modes", "2",
                 "--out", str(tmp_path)]  # fmt: skip
    assert main(arguments) == 0
    report = json.loads((tmp_path / "report.json").read_text())
    moving, fixed = report["cases"]
    assert (moving["hyper"], fixed["hyper"]) == ("none", "tensor")
    for case in (moving, fixed):
        assert case["stable"] and case["projection"] == "galerkin"
        assert 0 < case["velocity_median_percent"] < 5
    assert fixed["fom_seconds"] == moving["fom_seconds"]
    assert 0 < fixed["rom_seconds"] < moving["rom_seconds"]
    assert report["parameters"]["start"] == "balanced"
    own, points = report["bases"]
    assert (own["model"], own["map"]) == ("moving particles", "QuadraticMap")
    assert (points["model"], points["map"]) == ("tensor", "MovingLeastSquaresMap")
    assert own["cumulative_energy_percent"] != points["cumulative_energy_percent"]
    assert report["map"] == "QuadraticMap, MovingLeastSquaresMap" and report["spline_order"] == 3
    assert {"modes_1.png", "modes_2.png"} <= {path.name for path in tmp_path.glob("*.png")}
    printed = capsys.readouterr().out
    assert "hyper-reduction tensor" in printed
    # what the verdict says is what was measured
    cost = fixed["training_seconds"] + fixed["offline_seconds"]
    assert 0.0 < fixed["training_seconds"] < cost and moving["offline_seconds"] > 0.0
    runs = math.ceil(cost / (fixed["fom_seconds"] - fixed["rom_seconds"]))
    words = " ".join(printed.split())
    assert f"Making it took {cost:.3g} s" in words and f"paid back after {runs} run" in words
    assert f"velocity within {fixed['velocity_peak_percent']:.2g} %" in words
    assert verdict([Case(**moving), Case(**fixed)])[1] in words
    # the command that it ends with, and what the folder takes
    (command,) = re.findall(r"jaxsph-rom (predict .*)", printed)
    assert main([*command.split(), "--out", str(tmp_path / "predicted")]) == 0
    assert load(tmp_path / "model.h5").names == ("reynolds",)
    told = re.search(rf"disk: (\S+) (\w+) in {tmp_path}, (\S+) (\w+) of it runs", printed)
    kept = sum(p.stat().st_size for name in ("full", "reduced")
               for p in (tmp_path / name).rglob("*") if p.is_file())  # fmt: skip
    assert bytes_told(kept) == " ".join(told.groups()[2:]) and kept > 1e4
    assert (tmp_path / "fields_re_150.png").exists()
