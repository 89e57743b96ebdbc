"""Sums and extremes over time are those of the fields in the file."""

import numpy as np
import pytest

from jaxsph import history
from jaxsph.io import read_trajectory
from tests.runs import random_run


@pytest.mark.parametrize("every", [1, 3])
def test_history(tmp_path, monkeypatch, every):
    path = random_run(tmp_path / "t.h5", count=7)
    run = read_trajectory(path)
    monkeypatch.setattr(history, "_BLOCK_BYTES", 2 * 8 * 6 * 256)  # two snapshots a block
    read = []
    found = history.read_history(path, 256, 0.5, every, read.append)
    shown = slice(None, None, every)
    np.testing.assert_array_equal(found.time, run.time[shown])
    squares = (run.velocity[shown] ** 2).sum(axis=2)
    # the same numbers added up in another order: round-off only
    np.testing.assert_allclose(found.kinetic_energy, 0.25 * squares.sum(axis=1), rtol=1e-13)
    np.testing.assert_allclose(found.highest_speed, np.sqrt(squares).max(axis=1), rtol=1e-14)
    np.testing.assert_array_equal(found.lowest_density, run.density[shown].min(axis=1))
    np.testing.assert_array_equal(found.highest_density, run.density[shown].max(axis=1))
    assert sum(read) == len(found.time) and len(read) > 1
