"""Inverse problems at small size."""

import jax
import numpy as np
import pytest

from benchmarks.inverse import (
    initial_field,
    lid_profile,
    memory_and_closure,
    through_reduced,
    viscosity,
)
from benchmarks.inverse.__main__ import main


@pytest.fixture(autouse=True)
def usual_promotion():
    """optax's line search counts on it."""
    with jax.numpy_dtype_promotion("standard"):
        yield


@pytest.mark.slow
def test_viscosity_from_noisy_probes():
    found = viscosity.solve(side=16, end_time=0.2, steps=5)
    assert found["error_percent"] < 0.2 * found["errors_percent"][0]  # a fifth of the guess's
    assert found["losses"][-1] < found["losses"][0]


@pytest.mark.slow
def test_the_field_that_a_flow_started_from():
    found = initial_field.solve(side=12, end_time=0.04, probes=12, steps=12)
    assert found["loss_reduced_by"] > 100.0  # a thousand takes more steps
    assert found["field_error_percent"] < 30.0


@pytest.mark.slow  # two minutes, most of them compilation
def test_a_lid_for_a_wanted_line():
    found = lid_profile.solve(side=12, end_time=0.2, knots=5, steps=4)
    assert found["line_error_percent"] < 0.7 * found["line_error_at_start_percent"]


@pytest.mark.slow  # notebook 10 is the same
def test_memory_length_and_closure():
    found = memory_and_closure.solve(side=16, modes=3, end_time=0.08, steps=4, iterations=60)
    assert found["tau"]["losses"][-1] < found["tau"]["losses"][0]
    for number, errors in found["closure"]["with"].items():
        without = found["closure"]["without"][number]
        assert errors["velocity_peak_percent"] <= 1.1 * without["velocity_peak_percent"]


def test_through_a_reduced_model():
    found = through_reduced.solve(side=16, modes=3, end_time=0.2, steps=8, iterations=60, every=8)
    assert found["error_percent"] < 10.0  # the first guess is off by 71
    assert np.isfinite(found["verified_velocity_error_percent"])


def test_a_problem_that_is_not_there(capsys):
    assert main(["volcano"]) == 2
    assert "'volcano' is not one of viscosity" in capsys.readouterr().err
