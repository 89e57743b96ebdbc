"""The schemes' benchmark at a tiny size."""

import json

import numpy as np
import pytest

from benchmarks import schemes
from benchmarks.references.taylor_green_3d import kinetic_energy


@pytest.fixture(autouse=True)
def small(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    tiny = [{"kind": "vortex", "side": 16, "reynolds": 100.0, "mach": 0.1}]
    monkeypatch.setitem(schemes.SETS, "vortex", tiny)


def test_both_schemes_beside_each_other_once(tmp_path, capsys):
    path = tmp_path / "schemes.json"
    assert schemes.main(["--sets", "vortex", "--json", str(path)]) == 0
    rows = {row["scheme"]: row for row in json.loads(path.read_text())["rows"]}
    errors = {name: row["velocity_error_percent"] for name, row in rows.items()}
    assert 0 < errors["consistent"] < errors["delta-plus"] < 5
    assert rows["consistent"]["largest_energy_over_start"] < 1.001 and rows["consistent"]["seconds"]
    assert "consistent" in capsys.readouterr().out
    assert schemes.main(["--sets", "vortex", "--json", str(path)]) == 0
    assert len(json.loads(path.read_text())["rows"]) == 2


def test_the_spectral_reference_has_converged():
    """A wave that does not feel itself, Re = 1, decays as exp(-2 nu 3 k^2 t); and modes enough."""
    slow = kinetic_energy(1.0, 1e-3, modes=12)
    assert slow == pytest.approx(0.125 * np.exp(-6e-3 * (2.0 * np.pi) ** 2), rel=1e-4)
    assert kinetic_energy(100.0, 0.2, 16) == pytest.approx(kinetic_energy(100.0, 0.2, 24), rel=1e-4)
