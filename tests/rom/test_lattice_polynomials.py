"""Polynomials on a lattice, against functions they reproduce and against splines."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import Box, Space
from jaxsph.arrangements import Lattice
from jaxsph.kernels import WendlandC2
from jaxsph_rom import LatticePolynomials, LocalSplines
from jaxsph_rom.lattice_polynomials import on_lattice

DX = 0.1
CLOSED = Space(Box((0.0, -0.5), (1.0, 0.3), (False, False)), WendlandC2(), 2.0 * DX, DX)
PERIODIC = Space(Box((0.0, 0.0), (1.0, 1.0), (True, True)), WendlandC2(), 2.0 * DX, DX)


def lattice(space):
    return np.asarray(Lattice().positions(space))


def inside(space, count=60):
    box = space.box
    unit = np.random.default_rng(0).uniform(size=(count, box.dim))
    return jnp.asarray(np.asarray(box.lower) + unit * np.asarray(box.lengths))


@pytest.mark.parametrize("order, power", [(1, 1), (3, 3), (5, 5)])
def test_polynomials_of_its_degree_are_kept_up_to_the_walls(order, power):
    def function(x):
        return np.stack([x[:, 0] ** power * x[:, 1], (x[:, 0] - 2.0) * x[:, 1] ** power], axis=1)

    points = lattice(CLOSED)
    found = LatticePolynomials.fit(points, function(points), CLOSED, order)(inside(CLOSED))
    np.testing.assert_allclose(found, function(np.asarray(inside(CLOSED))), rtol=0, atol=1e-12)


def test_waves_converge_with_the_order_and_across_the_border():
    errors = []
    for count in (10, 20):
        space = Space(PERIODIC.box, WendlandC2(), 2.0 / count, 1.0 / count)
        points, places = lattice(space), inside(space)

        def wave(x):
            return np.sin(2.0 * np.pi * np.asarray(x)).sum(axis=1, keepdims=True)

        found = LatticePolynomials.fit(points, wave(points), space)
        errors.append(np.abs(np.asarray(found(places)) - wave(places)).max())
        around = jnp.asarray([[1.0 - 1e-9, 0.3], [1e-9, 0.3]])
        np.testing.assert_allclose(*np.asarray(found(around)), atol=1e-7)
    assert errors[0] / errors[1] > 11.0  # fourth order: 16


def test_points_in_any_order_are_met_and_sums_are_sums():
    points = np.random.default_rng(1).permutation(lattice(PERIODIC))
    values = np.random.default_rng(2).normal(size=(len(points), 3))
    made = LatticePolynomials.fit(points, values, PERIODIC)
    np.testing.assert_allclose(made(jnp.asarray(points)), values, atol=1e-12)
    matrix = jnp.asarray([[1.0, 0.0], [2.0, -1.0], [0.0, 0.5]])
    places = inside(PERIODIC)
    np.testing.assert_allclose(made.combined(matrix)(places), made(places) @ matrix, atol=1e-12)
    np.testing.assert_array_equal(made.select([2, 0])(places), made(places)[:, [2, 0]])
    assert (made.functions, made.combined(matrix).functions) == (3, 2)
    assert not made.overflow(places * 0.0)  # no crowd is too large


def test_beside_splines_on_a_smooth_function():
    points, places = lattice(CLOSED), inside(CLOSED)

    def function(x):
        return np.cos(2.0 * np.asarray(x)).prod(axis=1, keepdims=True)

    errors = [
        np.abs(np.asarray(rule.fit(points, function(points), CLOSED)(places)) - function(places))
        for rule in (LatticePolynomials, LocalSplines)
    ]
    assert errors[0].max() < errors[1].max() < 0.02


def test_derivatives_in_position():
    points = lattice(PERIODIC)
    made = LatticePolynomials.fit(points, np.sin(2.0 * np.pi * points[:, :1]), PERIODIC)
    places = inside(PERIODIC, 8)
    step = jnp.ones_like(places)
    tangent = jax.jvp(made, (places,), (step,))[1]
    central = (made(places + 1e-6 * step) - made(places - 1e-6 * step)) / 2e-6
    np.testing.assert_allclose(tangent, central, atol=1e-7)


BOX_IN_SPACE = Box((0.0, -0.5, 0.0), (1.0, 0.3, 0.7), (True, False, True))
IN_SPACE = Space(BOX_IN_SPACE, WendlandC2(), 2.0 * DX, DX)


@pytest.mark.parametrize("space", [PERIODIC, CLOSED, IN_SPACE])
@pytest.mark.parametrize("rule, order", [
    (LatticePolynomials, 1), (LatticePolynomials, 3), (LatticePolynomials, 5), (LocalSplines, 3)
])  # fmt: skip
def test_slopes_along_a_direction_are_those_of_the_gradient(space, rule, order):
    points, places = lattice(space), inside(space, 8)
    values = np.stack([np.sin(2.0 * points[:, 0]), np.prod(points, axis=1)], axis=1)
    fitted = rule.fit(points, values, space, order)
    gradient = jax.vmap(jax.jacfwd(lambda x: fitted(x[None])[0]))(places)
    direction = jnp.asarray(np.random.default_rng(1).normal(size=places.shape))
    wanted = jnp.einsum("pfk,pk->pf", gradient, direction)
    np.testing.assert_allclose(fitted.slope_along(places, direction), wanted, atol=1e-11)


def test_what_is_no_lattice_is_refused():
    points = lattice(PERIODIC)
    values = points[:, :1]
    assert on_lattice(points, PERIODIC) and not on_lattice(points + 0.01, PERIODIC)
    for wrong in (points + 0.01, points[:-1], np.concatenate([points[:-1], points[:1]])):
        with pytest.raises(ValueError, match="need a lattice that fills the box"):
            LatticePolynomials.fit(wrong, values[: len(wrong)], PERIODIC)
    with pytest.raises(ValueError, match="more than 11 points in each direction"):
        LatticePolynomials.fit(points, values, PERIODIC, 11)
    with pytest.raises(ValueError, match="need an odd one, 1, 3, ...; got 2"):
        LatticePolynomials.fit(points, values, PERIODIC, 2)
