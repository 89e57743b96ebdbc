"""Torque between cylinders: what the benchmark starts from and judges by, and its stored rows."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks import taylor_couette as benchmark

ROWS = Path(benchmark.__file__).parent / "results" / "taylor_couette.json"


@pytest.mark.parametrize("turns", ["inner", "outer"])
def test_it_starts_from_the_exact_flow(turns):
    case = dict(zip(benchmark.KEY, ("sharp-at-walls", "rows", turns, 8, 2.0), strict=True))
    scene, flow = benchmark.annulus(case)
    a, b = flow.coefficients
    for name, radius in (("inner", benchmark.INNER), ("outer", benchmark.OUTER)):
        speed = a * radius + b / radius
        assert speed == pytest.approx(benchmark.TURN * radius if name == turns else 0.0, abs=1e-12)
    position, velocity = (np.asarray(each)[None] for each in (
        scene.state.position, scene.state.velocity))  # fmt: skip
    known = SimpleNamespace(position=position, velocity=velocity)
    assert benchmark.profile_error(known, np.array([True]), flow) < 1e-10
    faster = SimpleNamespace(position=position, velocity=1.01 * velocity)
    assert benchmark.profile_error(faster, np.array([True]), flow) == pytest.approx(1.0)


def test_stored_torques_converge():
    rows = {
        (r["ghosts"], r["turns"], r["h_over_dx"], r["resolution"]): r
        for r in json.loads(ROWS.read_text())["rows"]
    }
    for turns in ("inner", "outer"):
        for wall in ("inner", "outer"):
            name = f"{wall}_torque_error_percent"
            coarse, fine = (abs(rows["lattice", turns, 2.0, n][name]) for n in (8, 16))
            assert fine < coarse
            assert max(abs(rows["rows", turns, 2.0, n][name]) for n in (8, 12, 16)) < 1.5
            for h, most in ((2.5, 0.5), (3.0, 0.2)):
                assert max(abs(rows["rows", turns, h, n][name]) for n in (12, 16)) < most


def test_bad_input_is_refused():
    assert benchmark.main(["--turns", "both"]) == 2
    assert benchmark.main(["--resolutions", "0"]) == 2
