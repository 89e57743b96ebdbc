"""Moving least squares: what it keeps, its order, walls, and what it refuses."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import Box, Space
from jaxsph.arrangements import JitteredLattice, Lattice
from jaxsph.interpolation import MovingLeastSquaresMap, QuadraticMap, ShepardMap
from jaxsph.kernels import WendlandC2


def make_space(side, dim=2, periodic=True):
    box = Box((0.0,) * dim, (1.0,) * dim, (periodic,) * dim)
    return Space(box, WendlandC2(), 2.0 / side, 1.0 / side)


def mapped(rule, points, space, x, values):
    found, overflow = jax.jit(rule.allocate(points, space).__call__)(x, values)
    assert not overflow
    return np.asarray(found)


@pytest.mark.parametrize("dim, side", [(2, 20), (3, 12)])
def test_least_squares_equal_a_dense_solution(dim, side):
    space = make_space(side, dim)
    x = JitteredLattice(amplitude=0.3, seed=1).positions(space)
    points = JitteredLattice(amplitude=0.3, seed=2).positions(space)
    values = np.random.default_rng(0).normal(size=(len(x), 2))
    found = mapped(MovingLeastSquaresMap, points, space, x, jnp.asarray(values))
    for k in (0, len(x) // 2, len(x) - 1):
        apart = np.asarray(x) - np.asarray(points)[k]
        apart -= np.round(apart)
        distance = jnp.linalg.norm(apart, axis=1)
        weight = np.sqrt(np.asarray(space.kernel.value(distance, space.smoothing_length, dim)))
        basis = np.concatenate([np.ones((len(x), 1)), apart / space.support], axis=1)
        fit = np.linalg.lstsq(basis * weight[:, None], values * weight[:, None], rcond=None)[0]
        np.testing.assert_allclose(found[k], fit[0], rtol=0, atol=1e-10)


def test_linear_fields_are_kept_next_to_walls_where_shepard_is_one_sided():
    space = make_space(16, periodic=False)
    x = JitteredLattice(amplitude=0.3, seed=1).positions(space)
    points = Lattice().positions(space)
    linear = 3.0 + 2.0 * x[:, :1] - x[:, 1:]
    exact = 3.0 + 2.0 * np.asarray(points)[:, :1] - np.asarray(points)[:, 1:]
    found = mapped(MovingLeastSquaresMap, points, space, x, linear)
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-12)
    one_sided = mapped(ShepardMap, points, space, x, linear)
    edge = np.abs(np.asarray(points)[:, 0] - 0.5) > 0.5 - space.spacing
    assert np.abs(one_sided - exact)[edge].max() > 0.05


def test_waves_on_a_lattice_are_mapped_at_second_order_as_shepards():
    # to first order both smooth a wave by the kernel's second moment
    space = make_space(32)
    x = Lattice().positions(space)
    wave = jnp.sin(2.0 * jnp.pi * x[:, :1])
    ours, shepard = (
        mapped(rule, x, space, x, wave) for rule in (MovingLeastSquaresMap, ShepardMap)
    )
    np.testing.assert_allclose(ours, shepard, rtol=0, atol=1e-12)


@pytest.mark.parametrize("dim, side, h_over_dx", [(2, 16, 1.5), (2, 16, 4.0), (3, 9, 1.5)])
def test_quadratic_fields_are_kept_next_to_walls_by_the_quadratic_map(dim, side, h_over_dx):
    box = Box((0.0,) * dim, (1.0,) * dim, (False,) * dim)
    space = Space(box, WendlandC2(), h_over_dx / side, 1.0 / side)
    x = JitteredLattice(amplitude=0.3, seed=1).positions(space)
    points = Lattice().positions(space)

    def field(x):
        return 3.0 + 2.0 * x[:, :1] - x[:, 1:2] ** 2 + x[:, :1] * x[:, -1:]

    found = mapped(QuadraticMap, points, space, x, field(x))
    np.testing.assert_allclose(found, field(points), rtol=0, atol=1e-10)


def test_the_quadratic_map_smooths_waves_at_fourth_order():
    errors = []
    for side in (24, 48):
        space = make_space(side)
        x = Lattice().positions(space)
        wave = jnp.sin(2.0 * jnp.pi * x[:, :1])
        errors.append(np.abs(mapped(QuadraticMap, x, space, x, wave) - wave).max())
    assert np.log2(errors[0] / errors[1]) > 3.8


def test_a_point_with_too_few_particles_gets_shepards_value():
    space = make_space(16, periodic=False)
    x = jnp.asarray([[0.5, 0.5], [0.5, 0.5 + 1e-5]])  # no spread to fit a slope to
    for rule in (MovingLeastSquaresMap, QuadraticMap):
        found = mapped(rule, jnp.asarray([[0.55, 0.5]]), space, x, jnp.asarray([[1.0], [1.0]]))
        np.testing.assert_allclose(found, [[1.0]], rtol=1e-12)


def test_gradients_in_values_and_places_are_finite():
    space = make_space(16, periodic=False)
    x = JitteredLattice(seed=1).positions(space)
    rule = MovingLeastSquaresMap.allocate(Lattice().positions(space), space)
    slope = jax.grad(lambda x, v: (rule(x, v)[0] ** 2).sum(), argnums=(0, 1))(x, x[:, :1])
    assert all(bool(jnp.isfinite(s).all()) for s in slope)


def test_a_narrow_periodic_box_is_refused():
    space = make_space(9)
    with pytest.raises(ValueError, match="three kernel supports"):
        MovingLeastSquaresMap.allocate(Lattice().positions(space), space)


@pytest.mark.parametrize("rule", [ShepardMap, MovingLeastSquaresMap, QuadraticMap])
def test_maps_have_a_reverse_mode(rule):
    """Probes on a line leave cells partly filled, and one lies on a particle."""
    space = make_space(12, periodic=False)
    x = Lattice().positions(space)
    line = jnp.stack([jnp.full(12, 0.5), jnp.linspace(0.04, 0.96, 12)], axis=1).at[3].set(x[40])
    found = rule.allocate(line, space)

    def total(x, values):
        return jnp.sum(found(x, values)[0] ** 2)

    values = jnp.sin(7.0 * x)
    slopes = jax.jit(jax.grad(total, argnums=(0, 1)))(x, values)
    along = jnp.cos(jnp.arange(x.size, dtype=x.dtype)).reshape(x.shape)
    for slope, argument in zip(slopes, (0, 1), strict=True):
        step = 1e-6
        moved = [
            [x, values][:argument] + [[x, values][argument] + s * step * along]
            + [x, values][argument + 1 :]
            for s in (1.0, -1.0)
        ]  # fmt: skip
        wanted = (total(*moved[0]) - total(*moved[1])) / (2.0 * step)
        assert float(jnp.sum(slope * along)) == pytest.approx(float(wanted), rel=1e-6)
