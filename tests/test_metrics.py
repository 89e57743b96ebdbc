"""Figures by which runs are judged, on signals that are known."""

import numpy as np
import pytest

from jaxsph.metrics import phase_error


def test_a_wave_that_is_ahead():
    time, place = np.linspace(0.0, 2.0, 201), np.linspace(0.0, 1.0, 7)

    def wave(ahead):
        phase = 2.0 * np.pi * (3.0 * time[:, None] - place[None, :]) + np.radians(ahead)
        return 0.4 + np.sin(phase)

    degrees, frequency = phase_error(time, wave(0.0), wave(25.0))
    assert degrees == pytest.approx(25.0, abs=0.5) and frequency == pytest.approx(3.0, abs=0.1)
    assert phase_error(time, wave(0.0), wave(-40.0))[0] == pytest.approx(-40.0, abs=0.5)
    assert phase_error(time, wave(10.0), wave(10.0))[0] == pytest.approx(0.0, abs=1e-9)


def test_what_is_steady_has_no_phase():
    time = np.linspace(0.0, 1.0, 11)
    with pytest.raises(ValueError, match="does not oscillate"):
        phase_error(time, np.full((11, 2), 3.0), np.ones((11, 2)))


def test_a_phase_needs_even_times():
    with pytest.raises(ValueError, match="four evenly spaced times"):
        phase_error(np.array([0.0, 1.0, 2.0, 4.0]), np.zeros((4, 1)), np.zeros((4, 1)))
