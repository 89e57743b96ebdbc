"""What fluctuations are taken from."""

import numpy as np
import pytest

from jaxsph import Fluid
from jaxsph_rom import (
    Energy,
    Euclidean,
    MeanCentred,
    RestCentred,
    Uncentred,
    pod,
    streaming_pod,
)

FLUID = Fluid(1000.0, 10.0, 1.0)


def snapshots(points=40, times=12):
    rng = np.random.default_rng(0)
    fields = 2.0 + rng.normal(size=(points, 3, times)) * 0.7 ** np.arange(times)
    fields[:, 0] += 1000.0
    return fields


def centred_coordinates(data, basis):
    weighted = basis.modes * basis.weights[None, :, None]
    return np.einsum("gfm,gfs->ms", weighted, data - basis.centre[:, :, None])


def test_where_the_centres_are():
    data = snapshots()
    np.testing.assert_array_equal(Uncentred().centre(data, FLUID), np.zeros((1, 3)))
    np.testing.assert_array_equal(RestCentred().centre(data, FLUID), [[1000.0, 0.0, 0.0]])
    mean = sum(data[:, :, k] for k in range(12)) / 12
    np.testing.assert_allclose(MeanCentred().centre(data, FLUID), mean, rtol=1e-14)


@pytest.mark.parametrize("centring", [Uncentred(), RestCentred(), MeanCentred()])
@pytest.mark.parametrize("product", [Euclidean(), Energy()])
def test_any_product_goes_with_any_centre(product, centring):
    data = snapshots()
    basis = pod(data, product, FLUID, centring=centring)
    found = basis.centre[:, :, None] + np.einsum(
        "gfm,ms->gfs", basis.modes, centred_coordinates(data, basis)
    )
    np.testing.assert_allclose(found, data, atol=1e-9)


@pytest.mark.parametrize("product", [Euclidean(), Energy()])
def test_each_product_has_a_centring_of_its_own(product):
    centring = {"Euclidean": Uncentred(), "Energy": RestCentred()}[type(product).__name__]
    own, named = pod(snapshots(), product, FLUID), pod(snapshots(), product, FLUID, None, centring)
    np.testing.assert_array_equal(own.centre, named.centre)
    np.testing.assert_array_equal(own.modes, named.modes)


def test_no_centre_leaves_less_to_the_modes_than_the_mean():
    data = snapshots()
    mean, *others = (
        pod(data, Energy(), FLUID, 5, centring)
        for centring in (MeanCentred(), RestCentred(), Uncentred())
    )
    energy = (mean.singular_values**2).sum()
    for other in others:
        offset = np.sum(mean.weights * (mean.centre - other.centre) ** 2)
        # Steiner: the energy about another centre is that about the mean and the offset's
        np.testing.assert_allclose((other.singular_values**2).sum(), energy + 12 * offset)
    np.testing.assert_allclose(centred_coordinates(data, mean).mean(axis=1), 0.0, atol=1e-10)


@pytest.mark.parametrize("size", [1, 5, 12])
def test_a_mean_in_blocks_is_that_of_all(size):
    data = snapshots()
    blocks = [data[:, :, :0], *(data[:, :, k : k + size] for k in range(0, 12, size))]
    whole = pod(data, Energy(), FLUID, 4, MeanCentred())
    streamed = streaming_pod(blocks, Energy(), FLUID, 4, centring=MeanCentred())
    np.testing.assert_allclose(streamed.centre, whole.centre, rtol=1e-14)
    np.testing.assert_allclose(
        streamed.singular_values[:11], whole.singular_values[:11], atol=1e-10
    )
    overlap = np.einsum("gfm,f,gfk->mk", streamed.modes, whole.weights, whole.modes)
    np.testing.assert_allclose(np.abs(overlap), np.eye(4), atol=1e-10)


def test_blocks_that_go_by_once_have_no_mean():
    data = snapshots()
    with pytest.raises(ValueError, match="blocks: this centring goes through them twice") as caught:
        streaming_pod((data for _ in range(2)), Energy(), FLUID, centring=MeanCentred())
    assert "\n" not in str(caught.value)
    once = streaming_pod((data for _ in range(1)), Euclidean(), FLUID, centring=RestCentred())
    np.testing.assert_array_equal(once.centre, [[1000.0, 0.0, 0.0]])
