"""Stirred particles: disordered, even, reproducible."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial import cKDTree

from jaxsph import Box, Space
from jaxsph.arrangements import Lattice, Stirred
from jaxsph.arrangements.stirred import swirl
from jaxsph.kernels import WendlandC2


def make_space(side, dim=2, lengths=None, periodic=True):
    lengths = (1.0,) * dim if lengths is None else lengths
    box = Box((0.0,) * dim, lengths, (periodic,) * dim)
    return Space(box, WendlandC2(), 2.0 / side, 1.0 / side)


@pytest.mark.parametrize(
    "dim, side, apart", [(2, 24, 0.5), pytest.param(3, 10, 0.35, marks=pytest.mark.slow)]
)
def test_particles_are_even_but_not_on_a_lattice(dim, side, apart):
    space = make_space(side, dim)
    x = np.asarray(Stirred().positions(space))
    assert x.shape == (side**dim, dim) and (x >= 0.0).all() and (x < 1.0).all()
    tree = cKDTree(x, boxsize=1.0)
    nearest = tree.query(x, k=2)[0][:, 1] / space.spacing
    assert nearest.min() > apart  # by shifting
    assert nearest.std() > 0.02  # and they are on no lattice
    volume = np.zeros(len(x))
    for i, around in enumerate(tree.query_ball_point(x, space.support)):
        apart = x[around] - x[i]
        distance = jnp.asarray(np.linalg.norm(apart - np.round(apart), axis=1))
        weight = space.kernel.value(distance, space.smoothing_length, dim)
        volume[i] = float(weight.sum()) * space.spacing**dim
    assert np.abs(volume - 1.0).max() < 0.1 and volume.std() < 0.02


def test_the_seed_decides():
    space = make_space(16)
    first = np.asarray(Stirred(seed=1).positions(space))
    np.testing.assert_array_equal(first, np.asarray(Stirred(seed=1).positions(space)))
    assert np.abs(first - np.asarray(Stirred(seed=2).positions(space))).max() > 0.1 * space.spacing
    assert Stirred(seed=1).record() == {"rule": "Stirred", "seed": 1, "way": 0.4}


@pytest.mark.parametrize("lengths", [(1.0, 1.0), (2.0, 1.0), (1.0, 2.0, 1.0)])
def test_stirring_is_solenoidal_in_any_box(lengths):
    space = make_space(8, len(lengths), lengths)
    x = Lattice().positions(space) + 0.01
    slopes = jax.vmap(jax.jacobian(lambda x: swirl(x[None], space)[0]))(x)
    divergence = jnp.trace(slopes, axis1=1, axis2=2)
    np.testing.assert_allclose(divergence, 0.0, atol=1e-12 * float(jnp.abs(slopes).max()))
    assert float(jnp.abs(swirl(x, space)[:, 0]).max()) <= 1.0


def test_walls_are_refused():
    with pytest.raises(ValueError, match="periodic all round"):
        Stirred().positions(make_space(16, periodic=False))
