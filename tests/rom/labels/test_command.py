"""`jaxsph-rom labels`, and `jaxsph-rom predict` of what it makes."""

import json

import numpy as np
import pytest

from jaxsph.io import read_trajectory
from jaxsph_rom.cli import main

WAVE = "labels standing-wave --resolution 16 --time-step 0.025 --t-end 8 --modes 3"
TRAINED = "--train amplitude=0.03,0.06 reynolds=500"


def test_a_free_surface_from_two_lines(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main([*WAVE.split(), *TRAINED.split(), "--json", "trained.json"]) == 0
    told = json.loads((tmp_path / "trained.json").read_text())
    assert (told["modes"], told["labels"]) == (3, 128) and told["error"] < 0.05
    out, model = tmp_path / "out" / "labels-standing-wave", "out/labels-standing-wave/model.h5"
    kept = {file: file.stat().st_mtime_ns for file in (out / "full").rglob("*.h5")}
    assert len(kept) == 2
    (out / "model.h5").unlink()
    capsys.readouterr()
    assert main([*WAVE.split(), *TRAINED.split()]) == 0  # full runs are kept
    assert "error on its runs" in capsys.readouterr().out
    assert kept == {file: file.stat().st_mtime_ns for file in (out / "full").rglob("*.h5")}
    at = ["--at", "amplitude=0.045,0.07", "reynolds=500"]
    assert main(["predict", model, *at, "--out", "waves", "--json", "waves.json"]) == 0
    printed = capsys.readouterr()
    assert "1 of 2 members are outside of the training runs" in printed.err
    assert "waves/member-001.h5" in printed.out
    members = json.loads((tmp_path / "waves.json").read_text())["members"]
    assert [m["parameters"]["amplitude"] for m in members] == [0.045, 0.07]
    assert all(m["fault"] is None and m["labels_mix_from"] is None for m in members)
    assert all(m["samples_miss_particles_from"] is None for m in members)
    runs = [read_trajectory(tmp_path / m["file"]) for m in members]
    heights = [run.position[0, :, 1] - run.position[3, :, 1] for run in runs]
    assert np.abs(heights[1]).max() > np.abs(heights[0]).max() > 0.0
    assert main(["show", "waves/member-001.h5"]) == 0
    assert "outside" in capsys.readouterr().out
    others = {"member-notes.h5", "re-100.h5"}  # of somebody else
    for name in others:
        (tmp_path / "waves" / name).touch()
    (tmp_path / "waves" / "prediction.h5").touch()  # of a model on points
    lost = [model, "--at", "amplitude=0.05,5,1e30", "--reynolds", "500"]
    for end in ([], ["--t-end", "4"]):
        assert main(["predict", *lost, *end, "--out", "waves", "--json", "waves.json"]) == 0
        members = json.loads((tmp_path / "waves.json").read_text())["members"]
        assert [bool(m["fault"]) for m in members] == [False, True, True]
        assert [bool(m["file"]) for m in members] == [True, False, False]
        assert "no snapshot" in capsys.readouterr().out
        files = {f.name for f in (tmp_path / "waves").glob("*.h5")}
        assert files == {"member-000.h5", *others}
    none = [model, "--at", "amplitude=5,1e30", "--reynolds", "500", "--out", "none"]
    assert main(["predict", *none]) == 1
    assert "error: all 2 members are lost: of the first, " in capsys.readouterr().err
    assert main(["predict", *lost, "--fields"]) == 2
    assert "--fields: is of models on points" in capsys.readouterr().err


@pytest.mark.slow  # half a minute
def test_samples_that_do_not_carry_their_own_runs_are_refused(tmp_path, monkeypatch, capsys):
    """Seventeen snapshots a run, in single precision: lost at once, and so no model."""
    monkeypatch.chdir(tmp_path)
    few = ["--samples", "12", "--precision", "float32", "--out", "few.h5"]
    assert main([*WAVE.split(), *TRAINED.split(), *few]) == 2
    assert "the model is lost on its own training runs" in capsys.readouterr().err
    assert not (tmp_path / "few.h5").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (WAVE, "--train"),
        (f"{WAVE} --train depth=1", "has no depth"),
        (f"{WAVE} {TRAINED} --amplitude 0.02", "given as a setting"),
        (f"{WAVE} {TRAINED} --modes 200", "modes: 200 asked for, more than the"),
        (f"{WAVE} {TRAINED} --samples 500", "samples: 500 asked for, but there are 1 to 128"),
        (
            "labels standing-wave --resolution 16 --t-end 1 --train amplitude=0.03,0.06",
            "snapshots, and a model on labels needs",
        ),
    ],
)
def test_bad_input_is_one_line_and_nothing_is_run(words, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(words.split()) == 2
    error = capsys.readouterr().err
    assert message in error and error.count("\n") == 1
    assert not list(tmp_path.rglob("*.h5"))
