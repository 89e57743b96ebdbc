"""What benchmarks share: a table that is taken up again, and the frame of their commands."""

import json
import math
from pathlib import Path

import jax
import jax.numpy as jnp
import pytest

from benchmarks import convergence, free_flows, lid_driven_cavity, plane_flows
from benchmarks.table import Table, command
from jaxsph import SimulationError
from jaxsph.integrate import Fault, FaultCode

RESULTS = Path(__file__).parents[2] / "benchmarks" / "results"
CASES = [{"flow": flow, "side": side} for flow in ("a", "b") for side in (1, 2)]


def read(path):
    return json.loads(path.read_text())


def test_rows_are_kept_one_by_one_and_not_made_again(tmp_path, capsys):
    path = tmp_path / "new" / "table.json"
    table = Table(path, ("flow", "side"), beside=lambda rows: {"count": len(rows)})
    for case in table.left(CASES):
        if case == CASES[2]:
            break
        table.add(case | {"error": math.inf})
        assert read(path)["count"] == len(table.rows)
    again = Table(path, ("flow", "side"), beside=lambda rows: {"count": len(rows)})
    assert again.rows == [case | {"error": None} for case in CASES[:2]]
    assert again.has(("a", 2)) and again.has(CASES[0]) and not again.has(("b", 1))
    capsys.readouterr()
    assert list(again.left(CASES)) == CASES[2:]
    told = capsys.readouterr().err.splitlines()
    assert told == ["done before: flow a, side 1", "done before: flow a, side 2",
                    "flow b, side 1", "flow b, side 2"]  # fmt: skip


def test_a_file_of_something_else_is_refused_and_stays(tmp_path):
    path = tmp_path / "table.json"
    Table(path, settings={"scale": "small"}, rows="cases").add({"modes": 5})
    before = path.read_text()
    assert read(path) == {"settings": {"scale": "small"}, "cases": [{"modes": 5}]}
    with pytest.raises(ValueError, match="other settings"):
        Table(path, settings={"scale": "half"}, rows="cases")
    with pytest.raises(ValueError, match="other results"):
        Table(path, ("rule",), settings={"scale": "small"}, rows="cases")
    assert path.read_text() == before


@pytest.mark.parametrize("of", [convergence, free_flows, lid_driven_cavity, plane_flows])
def test_results_of_the_repository_are_taken_up(of):
    key = of.KEY[:2] if of is free_flows else of.KEY  # older rows have no scheme
    table = Table(RESULTS / f"{of.__name__.rpartition('.')[2]}.json", key)
    assert table.rows and all(table.has(tuple(row[name] for name in key)) for row in table.rows)


def started(run, *argv, json=""):
    def arguments(add):
        add("--scale", default="small")

    return command("trial", "What it does.\n\nMore.", arguments, run, list(argv), json)


def test_a_command_has_its_options_its_file_and_its_precision(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    seen = []

    def run(options):
        seen.append((options.json.as_posix(), jnp.zeros(()).dtype))

    with jax.enable_x64(False):
        assert started(run) == 0
        assert started(run, "--scale", "not-small", json="trial_{scale}.json") == 0
        assert started(run, "--json", "own.json", json="trial_{scale}.json") == 0
    files = ["benchmarks/results/trial.json", "benchmarks/results/trial_not_small.json", "own.json"]
    assert seen == [(file, jnp.float64) for file in files]


def test_its_help_says_where_results_go(capsys):
    with pytest.raises(SystemExit):
        started(lambda options: None, "--help", json="trial_{scale}.json")
    shown = " ".join(capsys.readouterr().out.split())
    assert "benchmarks/results/trial_SCALE.json" in shown and "What it does." in shown


def lose(options):
    raise SimulationError(Fault(FaultCode.NOT_FINITE, 7, 3), 0.1)


def refuse(options):
    raise ValueError("modes: got 0.")


@pytest.mark.parametrize(
    "run, code, word",
    [(lose, 1, "full model: step 7"), (refuse, 2, "modes: got 0."), (lambda options: True, 1, "")],
)
def test_its_exit_code(run, code, word, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert started(run) == code
    assert capsys.readouterr().err.startswith(f"trial: error: {word}" if word else "")


def test_a_place_that_cannot_be_written_is_told_before_anything_is_run(tmp_path, capsys):
    assert started(lambda options: pytest.fail("was run"), "--json", str(tmp_path)) == 2
    assert "is a folder" in capsys.readouterr().err
