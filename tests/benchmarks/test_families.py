"""Families of scenes by which reduced models are judged."""

import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks import families
from benchmarks.family_scenes import CASES

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("name", CASES)
def test_unseen_points_are_inside_and_every_third_outside(name):
    points = CASES[name].points
    found = families.unseen(points, 9)
    low, high = ({n: f(p[n] for p in points) for n in points[0]} for f in (min, max))
    outside = [any(not low[n] <= p[n] <= high[n] for n in p) for p in found]
    assert outside == [False, False, True] * 3


@pytest.mark.parametrize("name", CASES)
def test_parameters_reach_the_scenes(name):
    case = CASES[name]
    scenes = [case.make(**point, resolution=16, end_time=0.5) for point in case.points[:2]]
    assert len(scenes[0].state.position) == len(scenes[1].state.position)
    lid = scenes[0].walls.velocity if name == "cavity" else scenes[0].state.velocity
    speed = float(np.abs(lid).max())
    beside = np.cos(np.pi / 16.0) ** 2  # the vortex is fastest half a spacing from the particles
    assert speed == pytest.approx({"cavity": 0.5, "vortex": 0.5 * beside}.get(name, 0.0), rel=0.02)


def test_errors_and_what_was_expected_of_them():
    rows = [
        {"error": 0.01 * k, "expected": 0.02 * k, "floor": 0.001, "outside": k == 4,
         "full_seconds": 2.0}
        for k in (1, 2, 3, 4)
    ]  # fmt: skip
    lost = {**rows[0], "error": None, "expected": None}
    found = families._summary([*rows, lost], {"all": 20.0})
    assert found["members"] == 5 and found["lost"] == 1
    assert found["rank_correlation"] == pytest.approx(1.0)
    assert found["expected_over_true"] == pytest.approx([2.0, 2.0, 2.0])
    assert found["median_error_inside"] == pytest.approx(0.02)
    assert found["median_error_outside"] == pytest.approx(0.04) and found["outside"] == 1
    assert found["break_even"] == pytest.approx(10.0)


@pytest.mark.slow
def test_a_family_is_judged_and_taken_up_again(tmp_path, capsys):
    path = tmp_path / "families.json"
    same = ["--cases", "vortex", "--resolution", "12", "--end-time", "0.5", "--unseen"]
    shown = tmp_path / "families.md"
    where = ["--out", str(tmp_path), "--json", str(path), "--page", str(shown)]
    assert families.main([*same, "1", *where]) == 0
    first = json.loads(path.read_text())["rows"]
    assert families.main([*same, "3", *where]) == 0
    rows = json.loads(path.read_text())["rows"]
    assert rows[0] == first[0] and [row["outside"] for row in rows] == [False, False, True]
    assert all(row["floor"] < row["error"] < 0.2 for row in rows)  # of 12 x 12 particles
    assert "rank correlation" in capsys.readouterr().out
    assert "| vortex | 3 (1) |" in shown.read_text()


def test_the_page_is_that_of_the_results():
    results = json.loads((ROOT / "benchmarks/results/families.json").read_text())
    assert (ROOT / "docs/measured/families.md").read_text() == families.page(results)
    assert {"cavity", "vortex", "channel"} <= set(results["summary"])
