"""The floating ball: linear theory's own checks, and a ball that goes straight down."""

import numpy as np
import pytest

from benchmarks.floating_ball import CROSSINGS, KEY, run
from benchmarks.heaving import period
from benchmarks.references import heaving_sphere
from benchmarks.references.heaving_sphere import ADDED_MASS, WAVE_NUMBER, Heave, added_mass


@pytest.mark.parametrize("number", [0.3, 0.6, 1.0, 1.6, 3.0])
def test_the_memory_of_the_waves_has_the_added_mass_of_the_table(number):
    """Kramers and Kronig: it is made of the damping alone."""
    assert added_mass(number**0.5) == pytest.approx(
        np.interp(number, WAVE_NUMBER, ADDED_MASS), abs=0.004
    )


def test_linear_theory_heaves_at_the_sphere_s_own_period(monkeypatch):
    """k a (1 + m) 2/3 = 1 in the end, and errors of the steps are small."""
    time = np.linspace(0.0, 3.0, 3001)
    height = Heave(0.15, 9.81).height(time, 0.03)
    assert height[0] == 0.03 and np.abs(height[1:]).max() < 0.03
    late = time > 1.0
    found = period(time[late], height[late], CROSSINGS)
    own = 2.0 * np.pi / np.sqrt(1.5 / (1.0 + 0.43) * 9.81 / 0.15)
    assert found == pytest.approx(own, rel=0.01)
    monkeypatch.setattr(heaving_sphere, "_STEPS", 2000)
    coarse = Heave(0.15, 9.81).height(time, 0.03)
    np.testing.assert_allclose(coarse, height, atol=1e-4 * 0.03)


@pytest.mark.slow
def test_a_ball_goes_straight_down():
    found = run(dict(zip(KEY, (6, 0.9, 0.1, 0.1, 0.1), strict=True)))
    assert found["sideways_in_spacings"] < 1e-9 and found["largest_turn"] < 1e-9
    assert found["linear_trough"] < found["trough"] < 0.8  # at 0.1 s; coarse ones are slow
    assert np.isnan(found["period"])
