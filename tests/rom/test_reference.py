"""The reference space: Shepard's operator and the snapshot matrices."""

import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import Box, Space, Trajectory
from jaxsph.arrangements import JitteredLattice, Lattice
from jaxsph.kernels import WendlandC2
from jaxsph_rom import ReferenceSpace, lagrangian_snapshots


def make_space(side, dim=2, h_over_dx=2.0):
    return Space(Box.unit_periodic(dim), WendlandC2(), h_over_dx / side, 1.0 / side)


@pytest.mark.parametrize("dim, side", [(2, 16), (3, 9)])
def test_composition_equals_a_brute_force_shepard_sum(dim, side):
    space = make_space(side, dim)
    x = JitteredLattice(amplitude=0.3, seed=1).positions(space)
    points = JitteredLattice(amplitude=0.3, seed=2).positions(space)
    fields = np.random.default_rng(0).normal(size=(len(x), 3))
    difference = np.asarray(points)[:, None] - np.asarray(x)[None]
    difference -= np.round(difference)
    distance = np.linalg.norm(difference, axis=-1)
    weight = np.asarray(space.kernel.value(jnp.asarray(distance), space.smoothing_length, dim))
    expected = weight @ fields / weight.sum(axis=1, keepdims=True)
    found, overflow = ReferenceSpace(points, space).compose(x, jnp.asarray(fields))
    assert not overflow
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)  # round-off of 50 terms


def test_a_constant_is_kept_and_a_wave_is_smoothed_at_second_order():
    errors = []
    for side in (16, 32, 64):
        space = make_space(side)
        x = Lattice().positions(space)
        points = x + 0.3 * space.spacing
        wave = jnp.sin(2 * jnp.pi * x[:, 0])
        mapped, _ = ReferenceSpace(points, space).compose(x, jnp.stack([0 * wave + 7.0, wave], 1))
        np.testing.assert_allclose(mapped[:, 0], 7.0, rtol=1e-14)
        errors.append(np.abs(mapped[:, 1] - np.sin(2 * np.pi * np.asarray(points[:, 0]))).max())
    order = np.polyfit(np.log([1 / 16, 1 / 32, 1 / 64]), np.log(errors), 1)[0]
    assert 1.9 < order < 2.1  # the kernel's second moment


def test_clumped_particles_are_refused_not_dropped():
    space = make_space(16)
    x = Lattice().positions(space)
    clumped = 0.25 * x
    reference = ReferenceSpace(x, space)
    assert reference.compose(clumped, jnp.ones((len(x), 1)))[1]
    trajectory = Trajectory(
        time=np.zeros(1),
        position=np.asarray(clumped)[None],
        velocity=np.zeros((1, len(x), 2)),
        density=np.ones((1, len(x))),
        pressure=np.zeros((1, len(x))),
    )
    with pytest.raises(ValueError, match="clumped"):
        reference.snapshots(trajectory)


def test_snapshots_stack_density_first():
    space = make_space(16)
    x = np.asarray(Lattice().positions(space))
    density = np.stack([np.full(len(x), 2.0), np.full(len(x), 3.0)])
    velocity = np.stack([np.full((len(x), 2), 5.0), np.full((len(x), 2), -1.0)])
    trajectory = Trajectory(np.arange(2.0), np.stack([x, x]), velocity, density, 0 * density)
    lagrangian = lagrangian_snapshots(trajectory)
    reference = ReferenceSpace(jnp.asarray(x), space).snapshots(trajectory)
    assert lagrangian.shape == reference.shape == (len(x), 3, 2)
    np.testing.assert_array_equal(lagrangian[0], [[2.0, 3.0], [5.0, -1.0], [5.0, -1.0]])
    np.testing.assert_allclose(reference, lagrangian, rtol=1e-14)
