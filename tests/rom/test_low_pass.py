"""The low-pass damps what is fast, keeps what is slow, and delays nothing."""

import numpy as np
import pytest

from jaxsph_rom import low_pass

RATE = 200.0  # Hz
TIME = np.arange(401) / RATE
INSIDE = slice(100, 301)  # away from where the signal is continued


def signal(values):
    return np.broadcast_to(values, (2, 3, len(values))).copy()


@pytest.mark.parametrize("frequency", [1.0, 4.0, 5.0, 8.0, 40.0])
@pytest.mark.parametrize("order", [2, 4])
def test_a_wave_keeps_its_phase_and_loses_what_the_formula_says(frequency, order):
    wave = np.sin(2 * np.pi * frequency * TIME + 0.3)
    found = low_pass(signal(wave), TIME, 5.0, order)
    # the bilinear transform bends frequencies to tan(pi f / rate)
    ratio = np.tan(np.pi * frequency / RATE) / np.tan(np.pi * 5.0 / RATE)
    gain = 1.0 / (1.0 + ratio ** (2 * order))
    assert found.shape == (2, 3, 401)
    # 3e-3 is what is left of the ends half a second on
    np.testing.assert_allclose(found[1, 2, INSIDE], gain * wave[INSIDE], atol=3e-3)


def test_a_uniform_state_stays_and_a_decay_nearly():
    np.testing.assert_allclose(low_pass(signal(np.full(401, 1000.0)), TIME, 5.0), 1000.0)
    decay = np.exp(-1.6 * TIME)  # of the pressure of the vortex at Re = 100
    error = np.abs(low_pass(signal(decay), TIME, 5.0) - decay)
    assert error.max() < 0.01 and error[..., INSIDE].max() < 1e-3


def test_each_number_of_the_state_is_filtered_by_itself():
    data = np.random.default_rng(0).normal(size=(3, 2, 401))
    weights = np.random.default_rng(1).normal(size=(4, 3))
    mixed = np.einsum("hg,gft->hft", weights, data)
    wanted = np.einsum("hg,gft->hft", weights, low_pass(data, TIME, 20.0))
    np.testing.assert_allclose(low_pass(mixed, TIME, 20.0), wanted, atol=1e-12)
    np.testing.assert_allclose(
        low_pass(data[..., ::-1], TIME, 20.0)[..., INSIDE],
        low_pass(data, TIME, 20.0)[..., ::-1][..., INSIDE],
        atol=1e-6,
    )


def test_precision_stays():
    assert low_pass(signal(TIME).astype(np.float32), TIME, 5.0).dtype == np.float32


def test_what_cannot_be_filtered_is_refused():
    data = signal(TIME)
    with pytest.raises(ValueError, match="cutoff: 100 Hz, but snapshots every 0.005 s"):
        low_pass(data, TIME, 100.0)
    with pytest.raises(ValueError, match="cutoff: 0 Hz"):
        low_pass(data, TIME, 0.0)
    with pytest.raises(ValueError, match="time: not evenly spaced"):
        low_pass(data, TIME**1.01, 5.0)
    with pytest.raises(ValueError, match="time: not evenly spaced"):
        low_pass(data, np.tile(TIME[:1], 401), 5.0)
    with pytest.raises(ValueError, match="snapshots: 15, but a filter of order 4 needs 16"):
        low_pass(data[..., :15], TIME[:15], 5.0)
    assert np.isfinite(low_pass(data[..., :16], TIME[:16], 5.0)).all()
    with pytest.raises(ValueError, match="time: 401 values for 400 snapshots"):
        low_pass(data[..., 1:], TIME, 5.0)
    with pytest.raises(ValueError, match="order: a filter needs at least 1"):
        low_pass(data, TIME, 5.0, 0)
