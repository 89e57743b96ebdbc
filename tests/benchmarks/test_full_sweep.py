"""The benchmark of full sweeps at small size."""

import json

import pytest

from benchmarks.full_sweep import main


@pytest.mark.slow
def test_members_are_single_runs(tmp_path):
    path = tmp_path / "found.json"
    small = ["--members", "2", "--side", "12", "--end-time", "0.04", "--devices", "1"]
    out = ["--out", str(tmp_path / "sweep.h5"), "--json", str(path)]
    assert main([*small, *out]) == 0
    found = json.loads(path.read_text())
    assert found["lost"] == 0
    assert max(v for k, v in found.items() if k.startswith("largest")) < 1e-12  # round-off
