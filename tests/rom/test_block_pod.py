"""Density and velocity with a basis each."""

import numpy as np
import pytest

from jaxsph import Fluid
from jaxsph_rom import (
    Energy,
    Euclidean,
    MeanCentred,
    RestCentred,
    block_pod,
    pod,
    projection_errors,
)

FLUID = Fluid(1000.0, 10.0, 1.0)


def snapshots(points=30, times=10):
    rng = np.random.default_rng(0)
    fields = rng.normal(size=(points, 3, times)) * 0.6 ** np.arange(times)
    fields[:, 0] = 1000.0 + 1e-3 * rng.normal(size=(points, times)) * 0.8 ** np.arange(times)
    return fields


def of_density(basis):
    return np.abs(basis.modes[:, 0]).max(axis=0) > 0.0


def fluctuation(data, basis):
    return data - basis.centre[:, :, None]


@pytest.mark.parametrize("product", [Euclidean(), Energy()])
def test_each_mode_is_of_one_field_and_all_are_orthonormal(product):
    data = snapshots()
    basis = block_pod(data, product, FLUID, centring=RestCentred())
    density = of_density(basis)
    assert density.sum() == 10 and basis.size == 20
    assert not basis.modes[:, 1:, density].any() and not basis.modes[:, 0, ~density].any()
    gram = np.einsum("gfm,f,gfk->mk", basis.modes, basis.weights, basis.modes)
    np.testing.assert_allclose(gram, np.eye(20), atol=1e-12)
    coordinates = np.einsum("gfm,f,gfs->ms", basis.modes, basis.weights, fluctuation(data, basis))
    found = np.einsum("gfm,ms->gfs", basis.modes, coordinates)
    np.testing.assert_allclose(found, fluctuation(data, basis), atol=1e-12)


def test_singular_values_are_those_of_either_block_over_its_norm():
    data = snapshots()
    basis = block_pod(data, Energy(), FLUID)
    change = fluctuation(data, basis)
    density = np.linalg.svd(change[:, 0], compute_uv=False)
    velocity = np.linalg.svd(change[:, 1:].reshape(-1, 10), compute_uv=False)
    wanted = np.concatenate([s / np.linalg.norm(s) for s in (density, velocity)])
    np.testing.assert_allclose(basis.singular_values, np.sort(wanted)[::-1], atol=1e-12)


@pytest.mark.parametrize("modes", [1, 7, (2, 5), (6, 1)])
def test_errors_of_the_whole_and_of_either_field(modes):
    data = snapshots()
    basis = block_pod(data, Energy(), FLUID, modes, MeanCentred())
    change = fluctuation(data, basis)
    if isinstance(modes, tuple):
        density = of_density(basis).sum()
        assert (density, basis.size - density) == modes
    for count in range(1, basis.size + 1):
        part = basis.truncated(count)
        coordinates = np.einsum("gfm,f,gfs->ms", part.modes, part.weights, change)
        left = change - np.einsum("gfm,ms->gfs", part.modes, coordinates)
        squared = [
            (left[:, block] ** 2).sum() / (change[:, block] ** 2).sum()
            for block in (slice(0, 1), slice(1, None))
        ]
        found = projection_errors(basis.singular_values)[count - 1]
        assert found == pytest.approx(np.sqrt(np.mean(squared)), rel=1e-9)


def test_a_number_of_modes_keeps_what_either_field_needs_most():
    data = snapshots()
    every, part = block_pod(data, Energy(), FLUID), block_pod(data, Energy(), FLUID, 6)
    np.testing.assert_array_equal(part.modes, every.truncated(6).modes)
    np.testing.assert_array_equal(part.singular_values, every.singular_values)
    assert 0 < of_density(part).sum() < 6
    # in the energy product the same density hides behind the velocity
    shared = pod(data, Energy(), FLUID, 6).modes * np.array([0.01, 1.0, 1.0])[None, :, None]
    assert (shared[:, 0] ** 2).sum() < 1e-6


def test_the_product_only_scales_the_modes():
    euclidean, energy = (
        block_pod(snapshots(), product, FLUID, (3, 4), RestCentred())
        for product in (Euclidean(), Energy())
    )
    scale = np.sqrt(energy.weights / euclidean.weights)[None, :, None]
    overlap = np.einsum("gfm,gfk->mk", euclidean.modes, energy.modes * scale)
    np.testing.assert_allclose(np.abs(overlap), np.eye(7), atol=1e-9)
    np.testing.assert_allclose(euclidean.singular_values, energy.singular_values, atol=1e-12)


def test_what_gives_no_modes_is_refused():
    data = snapshots()
    with pytest.raises(ValueError, match="modes: 11 of velocity asked for, but 10 snapshots"):
        block_pod(data, Energy(), FLUID, (3, 11))
    with pytest.raises(ValueError, match="modes: 0 of density"):
        block_pod(data, Energy(), FLUID, (0, 3))
    with pytest.raises(ValueError, match="modes: 21 of both fields asked for"):
        block_pod(data, Energy(), FLUID, 21)
    data[:, 0] = 1000.0
    with pytest.raises(ValueError, match="density is the centre at all times"):
        block_pod(data, Energy(), FLUID)
    data[0, 0, 0] = np.nan
    with pytest.raises(ValueError, match="not finite"):
        block_pod(data, Energy(), FLUID)
