"""`jaxsph-rom train` and `predict`: a model as a file, and one clear line for bad input."""

import json
import re

import h5py
import numpy as np
import pytest

from jaxsph.cli import main as look
from jaxsph.io import read_trajectory
from jaxsph_rom.cli import main
from jaxsph_rom.points import load, load_prediction
from tests.pages import checked_page

TRAIN = ["train", "taylor-green", "--resolution", "24", "--t-end", "0.05", "--modes", "2"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A model of four runs of four snapshots each."""
    folder = tmp_path_factory.mktemp("train")
    arguments = [*TRAIN, "--train", "100", "150", "200", "250", "--closure-iterations", "20"]
    arguments += ["--runs", str(folder), "--out", str(folder / "model.h5")]
    assert main([*arguments, "--json", str(folder / "train.json")]) == 0
    return folder


REPORT = ("prediction.h5", "report.html", "report.json")


def predict(folder, *arguments):
    return main(["predict", str(folder / "model.h5"), *arguments])


def test_what_a_model_cost_and_gets_wrong(folder):
    read = json.loads((folder / "train.json").read_text())
    assert sorted(named["reynolds"] for named in read["trained_on"]) == [100.0, 150.0, 200.0, 250.0]
    assert read["held_back"] == {"reynolds": 200.0}
    assert read["closure"] == "linear" and read["modes"] == 2
    for name in ("full_seconds", "offline_seconds", "closure_seconds"):
        assert read[name] > 0
    assert len(read["runs"]) == len(read["left_out"]) == 4
    for run in read["runs"]:
        floor, error = run["floor"], run["errors"]
        for name in ("velocity_median_percent", "pressure_median_percent"):
            assert 0 < 0.5 * floor[name] <= error[name] < 5
    assert read["parameters"]["start"] == "balanced"
    assert read["parameters"]["arrangement"]["rule"] == "Stirred"
    trained = load(folder / "model.h5")
    assert trained.range == {"reynolds": (100.0, 250.0)}
    assert trained.schedule.end_time == pytest.approx(0.05) and trained.scene == "taylor-green"


def test_nothing_of_an_earlier_prediction_stays_beside_a_new_one(folder, tmp_path):
    def there():
        return {str(p.relative_to(tmp_path)) for p in tmp_path.rglob("*") if p.is_file()}

    here = ["--out", str(tmp_path)]
    assert predict(folder, "--reynolds", "110", "120", "--fields", "--tracers", "9", *here) == 0
    before = there()
    assert before == {*REPORT, *(f"{kind}/re-{number}.h5" for number in (110, 120)
                                         for kind in ("fields", "tracers"))}  # fmt: skip
    (tmp_path / "fields" / "notes.txt").write_text("mine")  # no file of a prediction
    # one that is refused takes nothing away
    assert predict(folder, "--reynolds", "110", "--t-end", "0.012", *here) == 2
    assert there() == before | {"fields/notes.txt"}
    assert predict(folder, "--reynolds", "130", "--fields", *here) == 0
    assert there() == {*REPORT, "fields/re-130.h5", "fields/notes.txt"}
    told = json.loads((tmp_path / "report.json").read_text())
    assert told["lowest"] == told["highest"] == {"reynolds": 130.0}
    assert not (tmp_path / "tracers").exists()
    assert predict(folder, "--reynolds", "130", *here) == 0
    assert there() == {*REPORT, "fields/notes.txt"}


def test_a_sweep_from_one_line(folder, tmp_path, capsys):
    results = tmp_path / "p.json"
    assert predict(folder, "--reynolds", "110", "100:250:7", "--out", str(tmp_path),
                   "--json", str(results)) == 0  # fmt: skip
    captured = capsys.readouterr()
    assert "stable                 8 of 8" in captured.out and "warning" not in captured.err
    assert "Re 200: velocity" in captured.out  # never a time without an error
    read = json.loads(results.read_text())
    assert read["stable"] == read["members"] == 8 and read["run_seconds"] > 0
    found, trained = load_prediction(tmp_path / "prediction.h5"), load(folder / "model.h5")
    numbers = found.parameters["reynolds"]
    assert not found.outside.any() and (found.error_indicator < 0.1).all()
    np.testing.assert_allclose(numbers, [110, 100, 125, 150, 175, 200, 225, 250])
    assert found.coordinates.shape == (8, trained.schedule.intervals + 1, 2)
    np.testing.assert_array_equal(found.status, 0)
    # a vortex decays the faster, the lower its Reynolds number
    kept = np.sum(found.coordinates[1:, -1] ** 2, axis=1) / np.sum(
        found.coordinates[1:, 0] ** 2, axis=1
    )
    assert (np.diff(kept) > 0).all() and (kept < 1).all()
    exact = np.exp(-16 * np.pi**2 / numbers[1:] * found.time[-1])
    np.testing.assert_allclose(np.log(kept), np.log(exact), rtol=0.1)  # 24 x 24 particles
    assert {p.name for p in tmp_path.iterdir()} == {"p.json", *REPORT}
    assert json.loads((tmp_path / "report.json").read_text()) == read
    page = checked_page(tmp_path / "report.html")
    assert len(page.figures) == 2  # the last fields of the first, and errors over the numbers
    assert f"report: {tmp_path / 'report.html'}" in captured.out
    row = page.cells.index("ended") + 1
    assert page.cells[row] == "110" and page.cells[row + 1 : row + 4 : 2] == ["no", "whole"]
    for line in re.findall("Re .*: velocity .*", captured.out):
        assert line in page.text


def test_fields_and_tracers_as_trajectories(folder, tmp_path, capsys):
    assert predict(folder, "--reynolds", "300", "--t-end", "0.1", "--fields", "--tracers", "30",
                   "--out", str(tmp_path)) == 0  # fmt: skip
    warned = capsys.readouterr().err
    assert "1 of 1 Reynolds numbers are outside" in warned and "beyond the training" in warned
    fields = read_trajectory(tmp_path / "fields" / "re-300.h5")
    tracers = read_trajectory(tmp_path / "tracers" / "re-300.h5")
    assert fields.particles == 576 and tracers.particles == 30
    np.testing.assert_array_equal(fields.time, tracers.time)
    np.testing.assert_allclose(fields.coordinates, tracers.coordinates, rtol=0, atol=1e-12)
    # tracers start on reference points and move at the velocity of the fields there
    apart = np.abs(fields.position[0][:, None] - tracers.position[0][None]).sum(axis=2)
    at = apart.argmin(axis=0)
    np.testing.assert_allclose(apart.min(axis=0), 0.0, atol=1e-15)
    np.testing.assert_allclose(tracers.velocity[0], fields.velocity[0][at], atol=1e-9)
    np.testing.assert_allclose(tracers.pressure[0], fields.pressure[0][at], atol=1e-6)
    moved = (tracers.position[1] - tracers.position[0] + 0.5) % 1.0 - 0.5
    wanted = tracers.velocity[0] * (tracers.time[1] - tracers.time[0])
    np.testing.assert_allclose(moved, wanted, atol=0.02 * np.abs(wanted).max())
    assert tracers.metadata["tracers"]
    for kind in ("fields", "tracers"):  # they open as runs do
        file = str(tmp_path / kind / "re-300.h5")
        for command in ("show", "export", "animate"):
            assert look([command, file]) == 0
    shown = capsys.readouterr().out
    assert "30, in 2 dimensions" in shown and "not recorded" in shown
    assert "kinetic energy" not in shown  # the mass of a tracer means nothing


@pytest.mark.parametrize(
    "arguments, word",
    [
        (["--reynolds", "0"], "--reynolds"),
        (["--reynolds", "100:250"], "START:STOP:COUNT"),
        (["--reynolds", "250:100:5"], "START below STOP"),
        (["--at", "viscosity=0.1"], "--at reynolds="),
        (["--at", "reynolds=a"], "NAME=VALUE"),
        (["--reynolds", "100:250:1000000"], "at most 100000"),
        (["--reynolds", "100:250:101", "--fields"], "at most 100"),
        (["--reynolds", "100:250:101", "--tracers", "5"], "at most 100"),
        (["--reynolds", "100:250:60000", "--t-end", "500"], "GiB"),
        (["--reynolds", "100", "--t-end", "0.051"], "snapshot intervals"),
        ([], "--at reynolds="),
    ],
)
def test_bad_predictions_are_one_line_and_code_2(folder, tmp_path, capsys, arguments, word):
    out = tmp_path / "out"
    assert predict(folder, *arguments, "--out", str(out)) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and word in error
    assert not out.exists()


def test_bad_model_files_are_one_line_and_code_2(folder, tmp_path, capsys):
    path, out = tmp_path / "model.h5", tmp_path / "out"
    content = (folder / "model.h5").read_bytes()

    def refused(word):
        assert main(["predict", str(path), "--reynolds", "100", "--out", str(out)]) == 2
        error = capsys.readouterr().err
        assert error.count("\n") == 1 and word in error and not out.exists()

    refused("cannot be read")
    path.write_bytes(content[: len(content) // 2])
    refused("truncated or damaged")
    path.write_bytes((folder / "full" / "re-100" / "trajectory.h5").read_bytes())
    refused("holds no reduced flow")
    path.write_bytes(content)
    with h5py.File(path, "r+") as file:
        file.attrs["schema_version"] = 5
    refused("schema version 5")
    with h5py.File(path, "r+") as file:
        file.attrs["schema_version"] = 1
    refused("an earlier jaxsph_rom; make it anew")


@pytest.mark.parametrize(
    "arguments, word",
    [
        (["train", "no-such-scene"], "no-such-scene"),
        (["train", "couette"], "--train"),
        (["train", "dam-break", "--train", "100"], "scene dam-break has no reynolds"),
        (["train", "poiseuille", "--train", "10", "20", "40", "--resolution", "10"], "box"),
        (["train", "open-cavity", "--resolution", "32", "--settling", "0.01"], "KickAndHold"),
        ([*TRAIN, "--modes", "500"], "500 asked for"),
        ([*TRAIN, "--held-back", "120"], "Re 120"),
        ([*TRAIN, "--closure", "none", "--held-back", "150"], "nothing to judge"),
        ([*TRAIN, "--time-step", "1"], "stability limit"),
        ([*TRAIN, "--closure", "cubic"], "cubic"),
    ],
)
def test_bad_training_is_one_line_and_code_2(tmp_path, capsys, arguments, word):
    out = tmp_path / "out"
    assert main([*arguments, "--runs", str(out)]) == 2
    error = capsys.readouterr().err
    assert word in error and "error:" in error.splitlines()[-1]
    assert not (out / "model.h5").exists() and not (out / "full").exists()
