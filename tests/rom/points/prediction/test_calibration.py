"""Errors that residuals stand for, as runs have shown them."""

import numpy as np
import pytest

from jaxsph_rom.points.prediction.calibration import Calibration

POINTS = np.array([[20.0, 0.0], [40.0, 0.0], [80.0, 0.0], [80.0, 1.0]])


def test_the_scale_follows_the_parameters():
    residuals = np.array([0.6, 0.4, 0.3, 0.2])
    x = (POINTS - np.array([50.0, 0.5])) / np.array([60.0, 1.0])
    errors = residuals * np.exp(-4.0 + x @ np.array([1.5, 0.5]))
    found = Calibration.of(POINTS, errors, residuals)
    assert 0.9 < float(found.slope[0]) < 1.5 and 0.2 < float(found.slope[1]) <= 0.55  # held back
    expected = np.array([float(found(p)) for p in POINTS]) * residuals
    np.testing.assert_allclose(expected, errors, rtol=0.25)
    assert (np.argsort(expected) == np.argsort(errors)).all()


def test_beyond_twice_the_range_it_grows_no_more():
    found = Calibration.of(POINTS, [0.01, 0.02, 0.04, 0.04], np.ones(4))
    assert float(found(np.array([1e6, 0.0]))) == float(found(np.array([110.0, 0.0])))
    assert float(found(np.array([110.0, 0.0]))) > float(found(np.array([80.0, 0.0])))


def test_one_run_gives_its_own_ratio_and_lost_ones_nothing():
    inf = float("inf")
    found = Calibration.of(POINTS, [0.02, inf, inf, inf], [0.5, inf, inf, inf])
    assert float(found(POINTS[2])) == pytest.approx(0.04) and found.known
    assert float(found.times(3.0)(POINTS[0])) == pytest.approx(0.12)
    assert not Calibration.of(POINTS, [inf] * 4, [inf] * 4).known
    assert float(Calibration.none(2)(POINTS[0])) == 1.0
