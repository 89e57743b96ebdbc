"""Numbers of modes from what they are to hold."""

import numpy as np
import pytest

from jaxsph import Fluid
from jaxsph_rom import (
    Energy,
    MeanCentred,
    modes_for_energy,
    modes_for_error,
    pod,
    projection_errors,
)

FLUID = Fluid(1000.0, 10.0, 1.0)


@pytest.fixture(scope="module")
def data():
    rng = np.random.default_rng(0)
    fields = rng.normal(size=(30, 3, 9)) @ (0.5 ** np.arange(9)[:, None] * rng.normal(size=(9, 9)))
    fields[:, 0] += 1000.0
    return fields


def measured(data, basis, modes):
    """Relative error of projecting the fluctuations, in the basis' product."""
    change, part = data - basis.centre[:, :, None], basis.truncated(modes)
    coordinates = np.einsum("gfm,f,gfs->ms", part.modes, part.weights, change)
    left = change - np.einsum("gfm,ms->gfs", part.modes, coordinates)
    root = np.sqrt(basis.weights)[None, :, None]
    return np.linalg.norm(left * root) / np.linalg.norm(change * root)


@pytest.mark.parametrize("centring", [None, MeanCentred()])
def test_errors_are_those_of_the_projection(data, centring):
    basis = pod(data, Energy(), FLUID, centring=centring)
    found = projection_errors(basis.singular_values)
    wanted = [measured(data, basis, modes) for modes in range(1, basis.size + 1)]
    np.testing.assert_allclose(found[: basis.size], wanted, rtol=1e-6, atol=1e-12)
    assert (found[basis.size :] < 1e-12).all()  # beyond the rank, one lower about the mean


@pytest.mark.parametrize("error", [0.5, 0.1, 0.02])
def test_no_fewer_modes_reach_the_error(data, error):
    basis = pod(data, Energy(), FLUID)
    count = modes_for_error(basis, error)
    assert measured(data, basis, count) <= error
    assert count == 1 or measured(data, basis, count - 1) > error


def test_the_number_for_an_energy(data):
    basis = pod(data, Energy(), FLUID)
    sigma = basis.singular_values
    for percent in (40.0, 90.0, 99.0):
        count = modes_for_energy(basis, percent)
        assert 100 * sigma[:count].sum() / sigma.sum() >= percent
        assert 100 * sigma[: count - 1].sum() / sigma.sum() < percent
    assert modes_for_energy(basis, 100.0) in (basis.size - 1, basis.size)
    assert modes_for_error(basis, 0.0) == basis.size


def test_what_is_out_of_reach_is_refused(data):
    basis = pod(data, Energy(), FLUID, 2)
    with pytest.raises(ValueError, match=r"percent: 99.9 takes \d modes, but the basis has 2"):
        modes_for_energy(basis, 99.9)
    with pytest.raises(ValueError, match=r"error: 0.001 takes \d modes, but the basis has 2"):
        modes_for_error(basis, 0.001)
    for percent in (0.0, 100.1, np.nan):
        with pytest.raises(ValueError, match="percent"):
            modes_for_energy(basis, percent)
    for error in (-0.1, 1.0, np.nan):
        with pytest.raises(ValueError, match="error"):
            modes_for_error(basis, error)
