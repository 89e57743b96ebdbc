"""Numbers that follow a law of the parameters, and those that are interpolated."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph_rom.points import Between, Law
from jaxsph_rom.points.parameters.through_host import through_host

RNG = np.random.default_rng(0)


def test_a_law_is_found_and_holds_elsewhere():
    def truth(re, speed):
        return np.stack([speed / re, 8.0 / re, 3.0 + speed**2, np.full_like(re, 7.0)], axis=-1)

    points = RNG.uniform(1.0, 3.0, (9, 2))
    law = Law.find(points, truth(*points.T))
    elsewhere = np.array([7.0, 0.3])
    np.testing.assert_allclose(law(elsewhere), truth(*elsewhere), rtol=1e-9)
    slope = jax.jacobian(law)(jnp.asarray(elsewhere))
    np.testing.assert_allclose(slope[1], [-8.0 / 49.0, 0.0], rtol=1e-8, atol=1e-10)


def test_what_follows_none_has_none():
    points = np.linspace(1.0, 2.0, 7)[:, None]
    assert Law.find(points, np.sin(3.0 * points)) is None
    assert Law.find(points, np.where(points > 1.5, points, 0.0)) is None
    assert Law.find(points[:3], points[:3] ** 2) is None  # too few to test it
    zero = np.linspace(0.0, 1.0, 6)[:, None]
    np.testing.assert_allclose(Law.find(zero, 2.0 * zero)(np.array([3.0])), 6.0, rtol=1e-9)


def test_between_one_parameter_is_the_broken_line():
    points, values = np.array([[1.0], [2.0], [4.0]]), np.array([[0.0, 1.0], [1.0, 3.0], [5.0, 3.0]])
    between = Between.of(points, values)
    for x in (0.5, 1.0, 1.3, 2.0, 3.0, 9.0):
        wanted = [np.interp(x, points[:, 0], column) for column in values.T]
        np.testing.assert_allclose(between(np.array([x])), wanted, rtol=1e-12, atol=1e-12)
    left_out = np.interp(2.0, [1.0, 4.0], [0.0, 5.0]) - 1.0  # at the inner point
    assert between.left_out == pytest.approx(max(left_out, 3.0 - (1.0 + 2.0 / 3.0)) / 5.0)
    assert Between.of(points[:2], values[:2]).left_out == np.inf
    slope = jax.jacobian(between)(jnp.asarray([2.0]))
    assert np.isfinite(np.asarray(slope)).all()


def test_between_several_parameters_goes_through_the_points():
    points, values = RNG.normal(size=(6, 3)), RNG.normal(size=(6, 2))
    between = Between.of(points, values)
    for point, value in zip(points, values, strict=True):
        np.testing.assert_allclose(between(point), value, atol=1e-12)


@pytest.mark.parametrize("dtype, allowed", [(jnp.float64, 1e-10), (jnp.float32, 1e-4)])
def test_a_function_of_the_host_is_differentiated_through(dtype, allowed):
    def function(point):
        return np.array([np.sin(point[0]) / point[1], float(point[0]) ** 3])

    def traced(point):
        return through_host(function, 2, np.ones(2), point)

    point = jnp.asarray([0.7, 1.3], dtype)
    found = jax.jit(jax.jacrev(traced))(point)
    wanted = [[np.cos(0.7) / 1.3, -np.sin(0.7) / 1.69], [3 * 0.49, 0.0]]
    np.testing.assert_allclose(found, wanted, rtol=allowed, atol=allowed)
    several = jax.vmap(traced)(jnp.stack([point, 2.0 * point]))
    np.testing.assert_allclose(several[1], function(2.0 * np.asarray(point)), rtol=1e-6)


def test_of_no_numbers_there_is_a_law():
    points = np.array([[1.0], [2.0]])
    law = Law.find(points, np.zeros((2, 0)))
    assert law is not None and law(points[0]).shape == (0,)


def test_in_single_precision_an_inverse_is_no_parabola():
    points = np.linspace(50.0, 100.0, 6)[:, None]
    law = Law.find(points, (1.0 / points).astype(np.float32))
    assert law.inverted == ((True,),)
    np.testing.assert_allclose(law(np.array([20.0])), 1.0 / 20.0, rtol=1e-4)
    # a value that stays is no inverse either
    constant = Law.find(points, np.full((6, 1), 0.3, np.float32))
    np.testing.assert_allclose(constant(np.array([1e-3])), 0.3, rtol=1e-4)


def test_what_is_only_nearly_a_parabola_has_no_law_in_any_precision():
    points = np.linspace(50.0, 100.0, 6)[:, None]
    for dtype in (np.float32, np.float64):
        assert Law.find(points, np.exp(points / 50.0).astype(dtype)) is None
