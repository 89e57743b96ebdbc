"""Scenes at sizes of nobody's choice: every ending has its row and its reason."""

import pytest

from benchmarks.measure import read_json
from benchmarks.scene_sizes import cases, main, run
from jaxsph.scenes import SCENES


@pytest.mark.slow
def test_five_odd_sizes_a_scene_and_fewer_neighbours_in_space():
    found = cases(["taylor-green", "taylor-green-3d"], 10)
    assert len(found) == 10 and all(case["resolution"] % 2 for case in found)
    assert {case["h_over_dx"] for case in found[:5]} == {1.5, 2.0, 3.0, 4.0}
    assert {case["h_over_dx"] for case in found[5:]} == {1.5, 2.0, 3.0}


def test_endings_have_their_reasons():
    case = {"scene": "couette", "resolution": 15, "h_over_dx": 2.0, "steps": 10}
    good = run(case)
    assert good["outcome"] == "in bounds" and 0.0 < good["density"] < 0.05
    small = run(case | {"scene": "taylor-green-3d", "resolution": 7})
    assert small["outcome"] == "refused" and "Raise the resolution" in small["reason"]


def test_the_command_knows_its_scenes(tmp_path, capsys):
    assert main(["no-flow", "--json", str(tmp_path / "sizes.json")]) == 2
    told = capsys.readouterr().err
    assert all(name in told for name in SCENES)
    assert read_json(tmp_path / "sizes.json") is None
