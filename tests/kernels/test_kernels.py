"""Every kernel: normalised, positive, compact, smooth, gradient consistent with value."""

import dataclasses
from math import pi

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from jaxsph.kernels import QuinticSpline, WendlandC2, WendlandC4

KERNELS = [WendlandC2(), WendlandC4(), QuinticSpline()]
H = 0.37  # not 1, so that every power of h counts

each_kernel = pytest.mark.parametrize("kernel", KERNELS, ids=repr)
each_dim = pytest.mark.parametrize("dim", [2, 3])


def radii(kernel, count=200):
    """From zero to just inside the support."""
    return jnp.linspace(0.0, kernel.support * H, count, endpoint=False)


def volume_integral(kernel, dim, integrand):
    shell = {2: lambda r: 2.0 * pi * r, 3: lambda r: 4.0 * pi * r * r}[dim]
    compiled = jax.jit(integrand)
    knots = [knot * H for knot in range(1, int(kernel.support))]
    return quad(
        lambda r: float(compiled(jnp.asarray(r))) * shell(r),
        0.0,
        kernel.support * H,
        points=knots,
        epsabs=1e-12,
        epsrel=1e-12,
    )[0]


@each_kernel
@each_dim
def test_integrates_to_one(kernel, dim):
    integral = volume_integral(kernel, dim, lambda r: kernel.value(r, H, dim))
    assert integral == pytest.approx(1.0, abs=1e-10)  # quadrature of a piecewise polynomial


@each_kernel
@each_dim
def test_gradient_reproduces_linear_fields(kernel, dim):
    # By parts, int x . grad W dV = -dim int W dV.
    integral = volume_integral(kernel, dim, lambda r: r * r * kernel.gradient_over_r(r, H, dim))
    assert integral == pytest.approx(-dim, abs=1e-10)


@each_kernel
@each_dim
def test_gradient_is_the_derivative_of_the_value(kernel, dim):
    r = radii(kernel)
    derivative = jax.vmap(jax.grad(lambda s: kernel.value(s, H, dim)))(r)
    peak = float(jnp.max(jnp.abs(derivative)))
    # Round-off only, against the largest slope.
    np.testing.assert_allclose(r * kernel.gradient_over_r(r, H, dim), derivative, atol=1e-13 * peak)


@each_kernel
@each_dim
def test_smooth_at_zero_distance(kernel, dim):
    zero = jnp.asarray(0.0)
    limit = kernel.gradient_over_r(zero, H, dim)
    second = jax.grad(jax.grad(lambda s: kernel.value(s, H, dim)))(zero)
    assert limit < 0.0
    np.testing.assert_allclose(second, limit, rtol=1e-12)  # W'/r -> W'' as r -> 0; round-off
    nearby = kernel.gradient_over_r(jnp.asarray(1e-9 * H), H, dim)
    np.testing.assert_allclose(nearby, limit, rtol=1e-8)  # W'/r is Lipschitz in q
    assert jnp.isfinite(jax.grad(lambda s: kernel.gradient_over_r(s, H, dim))(zero))


@each_kernel
@each_dim
def test_derivative_of_the_gradient_matches_differences(kernel, dim):
    # Off the knots of the spline, and also on them.
    step = 1e-6 * H
    knots = H * jnp.arange(1.0, kernel.support)
    r = jnp.concatenate([radii(kernel, 37)[1:], knots])
    exact = jax.vmap(jax.grad(lambda s: kernel.gradient_over_r(s, H, dim)))(r)
    forward, backward = (kernel.gradient_over_r(r + s, H, dim) for s in (step, -step))
    scale = float(jnp.max(jnp.abs(exact)))
    # Central differences: round-off 1e-16 / 1e-6, truncation below it except on a knot (1e-6).
    np.testing.assert_allclose((forward - backward) / (2.0 * step), exact, atol=1e-5 * scale)


@each_kernel
@each_dim
def test_compact_and_continuous_at_the_support(kernel, dim):
    edge = kernel.support * H
    outside = edge * jnp.asarray([1.0 + 1e-12, 1.0 + 1e-3, 2.0, 1e6])
    inside = jnp.asarray(edge * (1.0 - 1e-6))
    for function in (kernel.value, kernel.gradient_over_r):
        np.testing.assert_array_equal(function(outside, H, dim), jnp.zeros(4))
        peak = jnp.abs(function(jnp.asarray(0.0), H, dim))
        assert 0.0 < jnp.abs(function(inside, H, dim)) < 1e-15 * peak  # at least cubic in 1e-6


@each_kernel
@each_dim
@given(q=st.floats(0.0, 10.0), h=st.floats(1e-4, 10.0))
def test_positive_and_decreasing_for_any_size(kernel, dim, q, h):
    r = jnp.asarray(q * h)
    value, slope = kernel.value(r, h, dim), kernel.gradient_over_r(r, h, dim)
    # The factors round apart: a few units in the last place above the peak as q -> 0.
    assert 0.0 <= value <= (1.0 + 1e-14) * kernel.value(jnp.asarray(0.0), h, dim)
    assert -jnp.inf < slope <= 0.0
    # Self-similar: W(q h, h) = W(q, 1) / h^n; round-off of q h grows towards the support.
    unit = kernel.value(jnp.asarray(q), 1.0, dim)
    peak = kernel.value(jnp.asarray(0.0), 1.0, dim)
    np.testing.assert_allclose(value * h**dim, unit, atol=1e-14 * float(peak))


@each_kernel
@each_dim
def test_single_precision_stays_single(kernel, dim):
    r = radii(kernel)
    for function in (kernel.value, kernel.gradient_over_r):
        double, single = function(r, H, dim), function(r.astype(jnp.float32), H, dim)
        assert single.dtype == jnp.float32
        scale = float(jnp.max(jnp.abs(double)))
        # Ten roundings of 6e-8; the spline cancels a few times its peak.
        np.testing.assert_allclose(single, double, atol=4e-6 * scale)


@each_kernel
def test_any_shape(kernel):
    r = radii(kernel, 24)
    for function in (kernel.value, kernel.gradient_over_r):
        np.testing.assert_array_equal(
            function(r.reshape(2, 3, 4), H, 2), function(r, H, 2).reshape(2, 3, 4)
        )


@each_kernel
def test_is_static_structure(kernel):
    assert kernel == type(kernel)() and hash(kernel) == hash(type(kernel)())
    assert [other for other in KERNELS if other == kernel] == [kernel]
    assert dataclasses.fields(kernel) == ()


@each_kernel
def test_rejects_a_dimension_it_does_not_have(kernel):
    with pytest.raises(ValueError, match="dim: .* got 1"):
        kernel.value(jnp.asarray(0.0), H, 1)
