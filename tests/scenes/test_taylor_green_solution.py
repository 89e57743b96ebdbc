"""The closed forms satisfy the incompressible Navier-Stokes equations, by differentiating them."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph.scenes.taylor_green_solution import (
    initial_pressure_3d,
    initial_velocity_3d,
    kinetic_energy,
    pressure,
    velocity,
)

VISCOSITY = 0.01  # m^2/s, Re = 100
DENSITY = 1000.0  # kg/m^3
TOLERANCE = 1e-10  # terms of up to 80 m/s^2 cancel to round-off, about 1e-14 each


@pytest.fixture
def points_and_times():
    point_key, time_key = jax.random.split(jax.random.key(0))
    return jax.random.uniform(point_key, (50, 2)), jax.random.uniform(time_key, (50,))


def momentum_residual(x, t, pressure_sign=1.0):
    """du/dt + u . grad u + grad p / rho - nu lap u, in m/s^2."""
    u = velocity(x, t, VISCOSITY)
    u_t = jax.jacfwd(velocity, argnums=1)(x, t, VISCOSITY)
    u_x = jax.jacfwd(velocity)(x, t, VISCOSITY)
    laplacian = jnp.trace(jax.hessian(velocity)(x, t, VISCOSITY), axis1=1, axis2=2)
    p_x = pressure_sign * jax.grad(pressure)(x, t, VISCOSITY, DENSITY)
    return u_t + u_x @ u + p_x / DENSITY - VISCOSITY * laplacian


def test_satisfies_momentum(points_and_times):
    residual = jax.vmap(momentum_residual)(*points_and_times)
    assert jnp.max(jnp.abs(residual)) < TOLERANCE


def test_opposite_pressure_sign_violates_momentum(points_and_times):
    residual = jax.vmap(lambda x, t: momentum_residual(x, t, -1.0))(*points_and_times)
    assert jnp.max(jnp.abs(residual)) > 1.0


def test_2d_velocity_is_solenoidal(points_and_times):
    gradient = jax.vmap(lambda x, t: jax.jacfwd(velocity)(x, t, VISCOSITY))(*points_and_times)
    assert jnp.max(jnp.abs(jnp.trace(gradient, axis1=1, axis2=2))) < TOLERANCE


def test_kinetic_energy_is_the_integral():
    # The mean over a lattice integrates these trigonometric polynomials exactly.
    axis = jnp.arange(8.0) / 8.0
    lattice = jnp.stack(jnp.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    for t in (0.0, 0.7):
        u = velocity(lattice, t, VISCOSITY)
        energy = 0.5 * DENSITY * jnp.mean(jnp.sum(u * u, axis=-1))
        np.testing.assert_allclose(kinetic_energy(t, VISCOSITY, DENSITY), energy, rtol=1e-13)


def test_energy_decays_by_viscous_dissipation():
    # dE/dt = -nu rho int |grad u|^2, and |grad u|^2 averages 2 k^2 |u|^2.
    energy = kinetic_energy(0.3, VISCOSITY, DENSITY)
    rate = jax.grad(kinetic_energy)(0.3, VISCOSITY, DENSITY)
    np.testing.assert_allclose(rate, -4.0 * VISCOSITY * (2.0 * np.pi) ** 2 * energy, rtol=1e-13)


def test_3d_pressure_satisfies_its_poisson_equation():
    def residual(x):
        u_x = jax.jacfwd(initial_velocity_3d)(x)
        laplacian = jnp.trace(jax.hessian(initial_pressure_3d)(x, DENSITY))
        return jnp.trace(u_x), -laplacian / DENSITY - jnp.sum(u_x * u_x.T)

    points = jax.random.uniform(jax.random.key(1), (50, 3))
    divergence, poisson = jax.vmap(residual)(points)
    assert jnp.max(jnp.abs(divergence)) < TOLERANCE
    assert jnp.max(jnp.abs(poisson)) < TOLERANCE


def test_dtype_and_shape_follow_the_points():
    points = jnp.zeros((7, 2), jnp.float32)
    assert velocity(points, 0.1, VISCOSITY).shape == (7, 2)
    assert pressure(points, 0.1, VISCOSITY, DENSITY).shape == (7,)
    assert velocity(points, 0.1, VISCOSITY).dtype == jnp.float32
    assert pressure(points, 0.1, VISCOSITY, DENSITY).dtype == jnp.float32
    assert initial_velocity_3d(jnp.zeros((7, 3), jnp.float32)).dtype == jnp.float32


def test_rejects_points_of_another_dimension():
    with pytest.raises(ValueError, match=r"position: expected shape \(\.\.\., 2\), got \(4, 3\)"):
        velocity(jnp.zeros((4, 3)), 0.0, VISCOSITY)
