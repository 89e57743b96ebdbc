"""Scenes that go on from a run at another resolution."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import ParticleState
from jaxsph.arrangements import JitteredLattice
from jaxsph.scenes import continued, lid_driven_cavity, taylor_green


def with_fields(scene, density, velocity):
    """The scene's particles with fields that are functions of position."""
    position = scene.state.position
    return ParticleState(position, velocity(position), density(position))


def test_linear_fields_are_carried_exactly_up_to_the_walls():
    coarse = lid_driven_cavity(12, arrangement=JitteredLattice(0.2))
    fine = lid_driven_cavity(20, arrangement=JitteredLattice(0.2))

    def density(x):
        return 1.0 + 0.01 * x[:, 0]

    def velocity(x):
        return jnp.stack([x[:, 1] - 0.3, 2.0 * x[:, 0]], axis=1)

    scene = continued(fine, with_fields(coarse, density, velocity), coarse.space)
    assert scene.parameters["continued_from_spacing"] == coarse.space.spacing
    started = scene.state
    np.testing.assert_array_equal(started.position, fine.state.position)
    np.testing.assert_allclose(started.density, density(fine.state.position), rtol=1e-12)
    np.testing.assert_allclose(started.velocity, velocity(fine.state.position), atol=1e-12)
    assert started.density.dtype == fine.state.density.dtype


def test_what_cannot_be_carried_is_refused():
    fine, coarse = lid_driven_cavity(20), lid_driven_cavity(12)
    other = taylor_green(16)
    with pytest.raises(ValueError, match="box: the two runs are in different boxes"):
        continued(fine, other.state, other.space)
    heap = dataclasses.replace(coarse.state, position=coarse.state.position * 0.0 + 0.5)
    with pytest.raises(ValueError, match="particles have clumped"):
        continued(fine, heap, coarse.space)
    lower = coarse.state.position[:, 1] < 0.3
    gap = jax.tree.map(lambda a: a[lower], coarse.state)
    with pytest.raises(ValueError, match="leaves a place without particles"):
        continued(fine, gap, coarse.space)
