"""Samples: what they reproduce exactly, and how many that takes."""

import numpy as np
import pytest
from scipy.optimize import nnls

from jaxsph_rom import Basis
from jaxsph_rom.points import QDEIM, NonNegativeWeights
from jaxsph_rom.points.dynamics.sampling.non_negative_weights import _lawson_hanson

POINTS, FIELDS = 60, 3
WEIGHTS = np.asarray([1e-4, 1.0, 1.0])
RULES = (QDEIM, NonNegativeWeights)


def random_basis(modes, seed):
    rng = np.random.default_rng(seed)
    q, _ = np.linalg.qr(rng.normal(size=(POINTS * FIELDS, modes)))
    fields = q.reshape(POINTS, FIELDS, modes) / np.sqrt(WEIGHTS)[None, :, None]
    return Basis(fields, np.zeros(FIELDS), WEIGHTS, np.geomspace(1.0, 0.1, modes))


def gathered(samples, rates):
    return np.einsum("mpf,pf...->m...", samples.gather, rates[samples.points])


def projected(basis, rates):
    return np.einsum("gfm,f,gf...->m...", basis.modes, basis.weights, rates)


@pytest.mark.parametrize("count", [2, 5, 9, 30])
def test_rates_within_their_modes_are_interpolated_exactly(count):
    basis, rates = random_basis(4, 0), random_basis(5, 1)
    samples = QDEIM(count, modes=5).choose(basis, rates)
    assert len(np.unique(samples.points)) == count
    wanted = projected(basis, rates.modes)
    np.testing.assert_allclose(gathered(samples, rates.modes), wanted, atol=1e-12)


def test_pivots_see_the_modes_better_than_chance():
    rates = random_basis(8, 2)
    matrix = rates.modes * np.sqrt(WEIGHTS)[None, :, None]

    def least(points):
        return np.linalg.svd(matrix[points].reshape(-1, 8), compute_uv=False)[-1]

    rng = np.random.default_rng(0)
    chance = [least(rng.choice(POINTS, 10, replace=False)) for _ in range(50)]
    chosen = least(QDEIM(10, modes=8).choose(random_basis(2, 3), rates).points)
    assert chosen > np.quantile(chance, 0.9)


def test_weights_are_not_negative_and_enough_of_them_are_exact():
    # 2 modes by 4 modes of the rates: at most 8 conditions, so at most 8 positive weights
    basis, rates = random_basis(2, 4), random_basis(4, 5)
    samples = NonNegativeWeights(POINTS).choose(basis, rates)
    weights = samples.gather / np.moveaxis(basis.modes[samples.points] * WEIGHTS[:, None], 2, 0)
    np.testing.assert_allclose(weights, weights[:1, :, :1] * np.ones_like(weights), rtol=1e-10)
    assert len(samples.points) <= 8 and weights.min() > 0.0
    wanted = projected(basis, rates.modes)
    np.testing.assert_allclose(gathered(samples, rates.modes), wanted, atol=1e-9)


def test_more_weighted_points_come_nearer():
    basis, rates = random_basis(3, 6), random_basis(6, 7)
    wanted = projected(basis, rates.modes) * rates.singular_values
    errors = []
    for count in (1, 3, 6, 12):
        samples = NonNegativeWeights(count).choose(basis, rates)
        assert len(samples.points) <= count
        found = gathered(samples, rates.modes) * rates.singular_values
        errors.append(np.linalg.norm(found - wanted))
    assert errors == sorted(errors, reverse=True) and errors[-1] < 0.5 * errors[0]


@pytest.mark.parametrize("seed", range(5))
def test_least_squares_are_those_of_an_independent_solver(seed):
    rng = np.random.default_rng(seed)
    matrix, wanted = rng.normal(size=(30, 20)), rng.normal(size=30)
    points, values = _lawson_hanson(matrix, wanted, 20)
    found = np.zeros(20)
    found[points] = values
    np.testing.assert_allclose(found, nnls(matrix, wanted)[0], atol=1e-10)


@pytest.mark.parametrize("rule", RULES)
def test_samples_that_cannot_be_are_named(rule):
    basis, rates = random_basis(2, 0), random_basis(3, 1)
    for count in (0, POINTS + 1):
        with pytest.raises(ValueError, match="1 to 60 points"):
            rule(count).choose(basis, rates)
    fewer = Basis(rates.modes[1:], rates.centre, rates.weights, rates.singular_values)
    with pytest.raises(ValueError, match="same reference points"):
        rule(2).choose(basis, fewer)


def test_more_modes_than_samples_carry_are_named():
    with pytest.raises(ValueError, match="1 samples of 5 modes carry 1 to 3"):
        QDEIM(1, modes=4).choose(random_basis(2, 0), random_basis(5, 1))
