"""Proper orthogonal decomposition and inner products."""

import numpy as np
import pytest

from jaxsph import Fluid
from jaxsph_rom import Energy, Euclidean, block_pod, cumulative_energy, pod, streaming_pod

FLUID = Fluid(1000.0, 10.0, 1.0)


def snapshots(points=40, times=12, rank=12):
    rng = np.random.default_rng(0)
    fields = rng.normal(size=(points, 3, rank)) @ rng.normal(size=(rank, times))
    fields[:, 0] += 1000.0
    return fields


@pytest.mark.parametrize("product", [Euclidean(), Energy()])
def test_modes_are_orthonormal_in_their_product_and_span_the_snapshots(product):
    data = snapshots()
    basis = pod(data, product, FLUID)
    weighted = (basis.modes * basis.weights[None, :, None]).reshape(-1, basis.size)
    flat = basis.modes.reshape(-1, basis.size)
    np.testing.assert_allclose(flat.T @ weighted, np.eye(basis.size), atol=1e-10)
    centred = (data - basis.centre[:, :, None]).reshape(-1, data.shape[2])
    np.testing.assert_allclose(flat @ (weighted.T @ centred), centred, atol=1e-9)


def test_truncation_is_optimal():
    """The squared error of M modes is the sum of the squares of the other singular values."""
    data = snapshots()
    basis = pod(data, Euclidean(), FLUID, 5)
    flat, matrix = basis.modes.reshape(-1, 5), data.reshape(-1, data.shape[2])
    error = np.linalg.norm(matrix - flat @ (flat.T @ matrix)) ** 2
    np.testing.assert_allclose(error, (basis.singular_values[5:] ** 2).sum(), rtol=1e-9)
    np.testing.assert_allclose(
        basis.singular_values, np.linalg.svd(matrix, compute_uv=False), rtol=1e-9
    )


def test_the_energy_product_is_kinetic_plus_acoustic_energy():
    basis = pod(snapshots(), Energy(), FLUID, 2)
    np.testing.assert_allclose(basis.weights, [1e-4, 1.0, 1.0])  # (c0 / rho0)^2
    np.testing.assert_allclose(basis.centre, [[1000.0, 0.0, 0.0]])


def test_cumulative_energy_sums_sigma_not_its_square():
    np.testing.assert_allclose(cumulative_energy(np.array([6.0, 3.0, 1.0])), [60.0, 90.0, 100.0])


def test_more_modes_than_snapshots_are_refused():
    with pytest.raises(ValueError, match="modes: 13 asked for, but 12 snapshots"):
        pod(snapshots(), Euclidean(), FLUID, 13)
    with pytest.raises(ValueError, match="modes"):
        pod(snapshots(), Euclidean(), FLUID, 4).truncated(5)


def test_modes_of_noise_are_refused():
    """Beyond the rank of the snapshots there is only round-off."""
    data = snapshots(rank=3)
    assert pod(data, Energy(), FLUID).size == 3
    assert len(pod(data, Energy(), FLUID, 3).singular_values) == 12
    for decompose in (pod, block_pod, lambda data, *rest: streaming_pod([data], *rest)):
        with pytest.raises(ValueError, match="modes: 10 .*asked for, but 12 snapshots give 1 to"):
            decompose(data, Energy(), FLUID, 10)
    fluid = Fluid(*(np.float32(x) for x in (1000.0, 10.0, 1.0)))
    assert pod(data.astype("float32"), Energy(), fluid).size == 3
    rest = np.zeros((40, 3, 12))
    rest[:, 0] = 1000.0
    for decompose in (pod, lambda data, *rest: streaming_pod([data], *rest)):
        with pytest.raises(ValueError, match="all 12 are the centre, which has no modes"):
            decompose(rest, Energy(), FLUID, 10)
    assert pod(rest, Euclidean(), FLUID).size == 1


@pytest.mark.parametrize("order", [(2, 0, 1), (1, 0, 2), (0, 2, 1)])
def test_another_order_of_axes_is_refused(order):
    for decompose in (pod, block_pod, lambda data, *rest: streaming_pod([data], *rest)):
        with pytest.raises(ValueError, match=r"shape .*give \(points, fields, times\)"):
            decompose(snapshots().transpose(order), Energy(), FLUID, 2)


def test_snapshots_that_are_not_finite_are_refused():
    data = snapshots()
    data[3, 1, 2] = np.nan
    with pytest.raises(ValueError, match="not finite"):
        pod(data, Euclidean(), FLUID)


def test_a_basis_says_what_it_holds():
    basis = pod(snapshots(), Euclidean(), FLUID, 5)
    energy = cumulative_energy(basis.singular_values)[4]
    count = len(basis.singular_values)
    for shown in (repr(basis), basis._repr_html_()):
        for told in (f"5 of {count}", "40 in 2D", f"{energy:.6g} %"):
            assert told in shown
    assert "\n" not in repr(basis)
