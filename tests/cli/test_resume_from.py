"""A run goes on from any of its snapshots, in a new file, to the same result."""

import numpy as np
import pytest

from jaxsph.cli import main
from jaxsph.io import read_overview, read_trajectory

RUN = ["run", "taylor-green", "--resolution", "16", "--arrangement", "jittered", "--t-end", "0.12"]
FROM = ["run", "taylor-green", "--resume", "first/trajectory.h5"]
FIELDS = ("time", "position", "velocity", "density", "pressure")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Where a whole run is, in `first`."""
    folder = tmp_path_factory.mktemp("runs")
    assert main([*RUN, "--out", str(folder / "first")]) == 0
    return folder


@pytest.mark.parametrize("start", [["--from-step", "0"], ["--from-step", "4"],
                                   ["--from-time", "0.04"], ["--from-time", "0.1001"]])  # fmt: skip
def test_it_repeats_the_run_bit_by_bit(folder, monkeypatch, capsys, start):
    monkeypatch.chdir(folder)
    before = (folder / "first" / "trajectory.h5").read_bytes()
    out = "-".join(["again", *start])
    assert main([*FROM, *start, "--out", out]) == 0
    assert (folder / "first" / "trajectory.h5").read_bytes() == before
    whole, again = (read_trajectory(f"{name}/trajectory.h5") for name in ("first", out))
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(again, name), getattr(whole, name))
    first = round(float(start[1]) / (0.01 if start[0] == "--from-time" else 1))
    assert again.metadata.get("resumed_from_step", 0) == first
    assert read_overview(f"{out}/trajectory.h5").complete
    assert (folder / out / "report.html").exists()
    printed = capsys.readouterr()
    assert "12/12" in printed.err and (f"from step {first} to t" in printed.out) == (first > 0)


@pytest.mark.parametrize(
    "arguments, message",
    [
        ([*FROM, "--from-step", "3", "--out", "x"], "no snapshot of step 3; it has those of steps "
         "0, 2, 4, ... to 12"),
        ([*FROM, "--from-time", "0.05", "--out", "x"], "no snapshot at t = 0.05 s; it has one "
         "every 0.02 s from 0 to 0.12 s"),
        ([*FROM, "--from-time", "7", "--out", "x"], "no snapshot of step 700"),
        ([*FROM, "--from-step", "12", "--out", "x"], "step 12 is its last; name an earlier one"),
        ([*FROM, "--from-step", "4"], "give its folder by --out"),
        ([*FROM, "--from-step", "4", "--out", "first"], "exists already"),
        ([*FROM, "--from-step", "4", "--out", "x", "--overwrite"], "--overwrite: a resumed run"),
        ([*FROM, "--from-step", "4", "--from-time", "1"], "not allowed with"),
        ([*FROM, "--from-step", "-4"], "--from-step: must be at least 0"),
        ([*FROM, "--out", "x"], "--out: a resumed run has its settings from its file"),
        ([*RUN, "--from-step", "4"], "name the file of the run by --resume"),
    ],
)  # fmt: skip
def test_bad_input_is_one_line(folder, monkeypatch, capsys, arguments, message):
    monkeypatch.chdir(folder)
    assert main(arguments) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and message in error
    assert not (folder / "x").exists()
