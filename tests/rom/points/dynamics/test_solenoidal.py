"""Modes without discrete divergence, and the matrix that says what that is."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import Box
from jaxsph.arrangements import Lattice
from jaxsph.scenes import lid_driven_cavity, taylor_green
from jaxsph_rom.points import (
    ReferenceOperators,
    divergence_matrix,
    galerkin_system,
    solenoidal_basis,
    without_divergence,
)
from jaxsph_rom.points.dynamics.local_matrix import local_matrix

SCENES = {
    "periodic": taylor_green(20, 100.0, arrangement=Lattice()),
    "walls": lid_driven_cavity(12, 100.0),
}
RNG = np.random.default_rng(0)


@pytest.fixture(scope="module", params=SCENES)
def operators(request):
    scene = SCENES[request.param]
    return ReferenceOperators.of_scene(scene, scene.state.position)


@pytest.fixture(scope="module")
def divergence(operators):
    return divergence_matrix(operators)


def test_a_matrix_found_by_probing_is_the_function(operators):
    points = np.asarray(operators.points)
    box = operators.space.box
    # sums over what is near, of two components with different weights
    apart = points[:, None, :] - points[None, :, :]
    for k in range(2):
        if box.periodic[k]:
            apart[..., k] -= box.lengths[k] * np.round(apart[..., k] / box.lengths[k])
    near = np.linalg.norm(apart, axis=2) < 0.2
    weights = np.stack([near * apart[..., 0], near * (1.0 + apart[..., 1])], axis=2)
    found = local_matrix(
        lambda v: np.einsum("ijc,jc->i", weights, v), points, 2, box, reach=0.2
    )
    np.testing.assert_allclose(found.toarray(), weights.reshape(len(points), -1), atol=1e-15)


def test_the_divergence_is_that_of_the_full_models_continuity(operators, divergence):
    velocity = RNG.normal(size=operators.points.shape)
    fields = operators.rest.at[:, 1:].set(velocity)
    rates = operators.affine(fields, jnp.zeros(()))
    expected = -np.asarray(rates[:, 0] / operators.functional.fluid.reference_density)
    np.testing.assert_allclose(divergence @ velocity.reshape(-1), expected, atol=1e-11)


def test_the_nearest_field_without_divergence(operators, divergence):
    count = len(operators.points)
    velocity = RNG.normal(size=(count, 2, 2))
    clean = without_divergence(velocity, divergence)
    flat, left = clean.reshape(-1, 2), (velocity - clean).reshape(-1, 2)
    before = np.abs(divergence @ velocity.reshape(-1, 2)).max()
    assert np.abs(divergence @ flat).max() < 1e-9 * before
    np.testing.assert_allclose(flat.T @ left, 0.0, atol=1e-9)  # nearest: nothing in common
    np.testing.assert_allclose(without_divergence(clean, divergence), clean, atol=1e-10)


def test_a_shear_flow_in_a_periodic_box_stays_as_it_is():
    scene = SCENES["periodic"]
    operators = ReferenceOperators.of_scene(scene, scene.state.position)
    y = np.asarray(operators.points)[:, 1]
    shear = np.stack([np.sin(2.0 * np.pi * y), np.zeros_like(y)], axis=1)[:, :, None]
    clean = without_divergence(shear, divergence_matrix(operators))
    np.testing.assert_allclose(clean, shear, atol=1e-10)


def test_modes_feel_no_pressure_and_those_of_fewer_come_first(operators, divergence):
    scene = next(s for s in SCENES.values() if s.space == operators.space)
    count = len(operators.points)
    snapshots = RNG.normal(size=(count, 3, 6))
    basis = solenoidal_basis(snapshots, operators, 4)
    flat = basis.modes[:, 1:].reshape(-1, 4)
    np.testing.assert_allclose(flat.T @ flat, np.eye(4), atol=1e-12)
    assert np.abs(divergence @ flat).max() < 1e-9 and not basis.modes[:, 0].any()
    fewer = solenoidal_basis(snapshots, operators, 2)
    np.testing.assert_allclose(fewer.modes, basis.modes[:, :, :2], atol=1e-12)
    # without sound, its speed does not matter
    system = galerkin_system(scene, basis, operators.points)
    slower = dataclasses.replace(scene.fluid, sound_speed=0.5 * scene.fluid.sound_speed)
    other = galerkin_system(dataclasses.replace(scene, fluid=slower), basis, operators.points)
    for name in ("constant", "linear", "quadratic"):
        a, b = getattr(system, name), getattr(other, name)
        np.testing.assert_allclose(a, b, atol=1e-9 * np.abs(a).max())


def test_what_cannot_be_decomposed_is_refused():
    scene = SCENES["walls"]
    operators = ReferenceOperators.of_scene(scene, scene.state.position)
    snapshots = RNG.normal(size=(len(operators.points), 3, 3))
    with pytest.raises(ValueError, match="modes: 4 asked for, but 3 snapshots"):
        solenoidal_basis(snapshots, operators, 4)
    snapshots[5, 1, 2] = np.nan
    with pytest.raises(ValueError, match="not finite"):
        solenoidal_basis(snapshots, operators, 2)


def test_points_at_both_ends_of_a_periodic_box_are_neighbours():
    box = Box((0.0, 0.0), (1.0, 1.0), (True, False))
    points = np.array([[0.02, 0.5], [0.98, 0.5], [0.5, 0.02], [0.5, 0.98]])
    found = local_matrix(lambda v: v.sum(axis=1)[[1, 0, 2, 3]], points, 1, box, reach=0.1)
    np.testing.assert_array_equal(found.toarray(), np.eye(4)[[1, 0, 2, 3]])
