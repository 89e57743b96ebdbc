"""Local polyharmonic splines."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import RBFInterpolator

from jaxsph import Box, Space
from jaxsph.arrangements import JitteredLattice
from jaxsph.kernels import WendlandC2
from jaxsph_rom import LocalSplines


def setting(side=24, dim=2, periodic=True, seed=0):
    box = Box((0.0,) * dim, (1.0,) * dim, (periodic,) * dim)
    space = Space(box, WendlandC2(), 2.0 / side, 1.0 / side)
    points = np.asarray(JitteredLattice(amplitude=0.2, seed=seed).positions(space))
    return space, points


def waves(x):
    x = np.asarray(x)
    return np.stack(
        [np.sin(2 * np.pi * x[:, 0]) * np.cos(2 * np.pi * x[:, 1]), np.cos(4 * np.pi * x[:, 1])], 1
    )


@pytest.mark.parametrize("order", [1, 2, 3, 4, 5])
def test_exact_at_the_nodes(order):
    space, points = setting()
    splines = LocalSplines.fit(points, waves(points), space, order)
    found = splines(jnp.asarray(points))
    # the systems' condition grows with the order: 1e-12 for k = 1 to 1e-9 for k = 5
    np.testing.assert_allclose(found, waves(points), atol=1e-9)


@pytest.mark.slow
@pytest.mark.run_once
def test_exact_at_the_nodes_in_three_dimensions():
    space, points = setting(side=12, dim=3)
    splines = LocalSplines.fit(points, waves(points), space, 3)
    np.testing.assert_allclose(splines(jnp.asarray(points)), waves(points), atol=1e-10)


@pytest.mark.parametrize("order, kernel", [(1, "linear"), (2, "thin_plate_spline"), (3, "cubic")])
def test_equals_an_independent_spline_on_the_same_nodes(order, kernel):
    """Inside a closed box of 3 cells a side, the middle cell's spline sees all points."""
    space, points = setting(side=12, periodic=False)
    splines = LocalSplines.fit(points, waves(points), space, order, margin=6.0)
    assert splines.grid.shape == (3, 3)
    queries = np.random.default_rng(0).uniform(0.34, 0.66, (50, 2))
    expected = RBFInterpolator(points, waves(points), kernel=kernel, degree=1)(queries)
    np.testing.assert_allclose(splines(jnp.asarray(queries)), expected, atol=1e-9)


def test_linear_functions_are_reproduced():
    space, points = setting(periodic=False)
    linear = (points @ np.array([2.0, -3.0]) + 1.0)[:, None]
    queries = np.random.default_rng(0).uniform(0, 1, (300, 2))
    found = LocalSplines.fit(points, linear, space, 3)(jnp.asarray(queries))
    np.testing.assert_allclose(found[:, 0], queries @ [2.0, -3.0] + 1.0, atol=1e-10)


def border_jump(side, order):
    """Largest jump of the waves' interpolant across cell borders."""
    space, points = setting(side=side)
    splines = LocalSplines.fit(points, waves(points), space, order, margin=4.0)
    rng = np.random.default_rng(1)
    along = rng.uniform(0, 1, 200)
    border = rng.integers(0, splines.grid.shape[0], 200) * splines.grid.widths[0]
    sides = [jnp.asarray(np.stack([(border + e) % 1.0, along], 1)) for e in (-1e-9, 1e-9)]
    below, above = (np.asarray(splines(x)) for x in sides)
    return np.abs(above - below).max()


def test_the_jump_across_cell_borders_is_small_and_falls_with_resolution_and_order():
    jumps = {(side, order): border_jump(side, order) for side in (16, 32) for order in (1, 3)}
    assert jumps[32, 3] < 1e-3  # measured 2e-5: far below a percent of projection error
    assert jumps[32, 3] < 0.5 * jumps[16, 3]
    assert jumps[32, 3] < jumps[32, 1]
    assert jumps[16, 3] > 1e-9  # a jump there is: the measurement sees it


def test_derivative_in_position_equals_a_central_difference():
    space, points = setting()
    splines = LocalSplines.fit(points, waves(points), space, 3)
    x = jnp.asarray(points) + 0.1 * space.spacing
    v = jnp.asarray(np.random.default_rng(0).normal(size=x.shape)) * space.spacing
    tangent = jax.jvp(splines, (x,), (v,))[1]
    eps = 1e-5
    central = (splines(x + eps * v) - splines(x - eps * v)) / (2 * eps)
    # a particle may cross a border between the two: none does at this seed and eps
    np.testing.assert_allclose(tangent, central, atol=1e-6 * np.abs(central).max())
    at_nodes = jax.jvp(splines, (jnp.asarray(points),), (v,))[1]
    assert np.isfinite(at_nodes).all()


def test_an_overfull_cell_is_flagged():
    space, points = setting()
    splines = LocalSplines.fit(points, waves(points), space, 3)
    assert not splines.overflow(jnp.asarray(points))
    assert splines.overflow(jnp.asarray(0.3 * points))


def test_bad_settings_are_refused():
    space, points = setting()
    with pytest.raises(ValueError, match="order"):
        LocalSplines.fit(points, waves(points), space, 0)
    with pytest.raises(ValueError, match="too few"):
        LocalSplines.fit(points[:1], waves(points[:1]), space, 3)


def test_selecting_functions_is_fitting_them_alone():
    space, points = setting()
    both = LocalSplines.fit(points, waves(points), space, 3)
    alone = LocalSplines.fit(points, waves(points)[:, 1:], space, 3)
    x = jnp.asarray(points) + 0.01
    np.testing.assert_allclose(both.select(np.array([1]))(x), alone(x), atol=1e-13)
