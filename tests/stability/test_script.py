"""The script of hard cases: results kept and taken up again, a page made of them."""

import dataclasses
import json
from types import SimpleNamespace

import pytest

from benchmarks import stability
from benchmarks.hard_cases.cases import CASES

CHOSEN = "step/2-h-over-c0-scene"


def test_results_and_page(tmp_path, capsys, monkeypatch):
    json_path, page = tmp_path / "results" / "stability.json", tmp_path / "docs" / "stability.md"
    same = ["--json", str(json_path), "--page", str(page)]
    assert stability.main([*same, "--cases", CHOSEN]) == 0
    (row,) = json.loads(json_path.read_text())["cases"]
    assert row["ending"] == "refused" and row["complaints"] == [] and row["finite"]
    assert {"versions", "machine", "device"} <= row["environment"].keys()
    assert "beyond the stability limit" in page.read_text()
    capsys.readouterr()

    # a case that breaks its promise is told, with code 1, unless it is known to
    case = CASES[CHOSEN]
    changed = dataclasses.replace(case, says="other words")
    monkeypatch.setitem(CASES, case.name, changed)
    assert stability.main([*same, "--cases", CHOSEN]) == 1
    assert "'other words' is not in" in capsys.readouterr().out
    assert "**not as promised**" in page.read_text()
    monkeypatch.setitem(CASES, case.name, dataclasses.replace(changed, wrong="known"))
    assert stability.main([*same, "--cases", CHOSEN]) == 0
    assert "Known faults" in page.read_text()

    monkeypatch.setattr(stability, "run_case", None)  # nothing is run again
    assert stability.main([*same, "--cases", CHOSEN]) == 0
    assert "1 of 1 cases done before" in capsys.readouterr().err
    assert stability.main([*same, "--cases", "no-such/*"]) == 2
    assert "no name matches 'no-such/*'" in capsys.readouterr().err


def test_long_cases_are_asked_for():
    quick, every = (
        stability._chosen(SimpleNamespace(cases=None, slow=slow)) for slow in (False, True)
    )
    assert quick and not any(case.slow for case in quick)
    assert every == list(CASES.values())


@pytest.mark.parametrize("case", list(CASES.values()), ids=list(CASES))
def test_every_case_says_what_it_bounds(case):
    assert case.what and "/" in case.name and case.endings
    names = [bound.name for bound in case.bounds]
    assert len(names) == len(set(names))
    assert all(bound.reason and bound.measure.__doc__ for bound in case.bounds)
    assert case.bounds or "finished" not in case.endings
