"""Turns of rigid bodies against SciPy's, against those in a plane, and against exact tops."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxsph.walls.rotation import (
    across,
    angle_rate,
    spin_rate,
    turned,
    turned_on,
    within_half_a_turn,
)

SIZES = [0.0, 1e-9, 1e-3, 0.0999, 0.1001, 1.0, 3.14, 6.0]  # rad; series end at 0.1
RNG = np.random.default_rng(5)
VECTORS = RNG.normal(size=(7, 3))


def of_size(size):
    axes = RNG.normal(size=(7, 3))
    return axes / np.linalg.norm(axes, axis=1, keepdims=True) * size


@pytest.mark.parametrize("size", SIZES)
def test_vectors_are_turned_as_by_scipy(size):
    angles, others = of_size(size), of_size(0.7)
    expected = Rotation.from_rotvec(angles).apply(VECTORS)
    a, v = jnp.asarray(angles), jnp.asarray(VECTORS)
    np.testing.assert_allclose(turned(a, v), expected, atol=1e-14)
    np.testing.assert_allclose(turned(-a, jnp.asarray(expected)), VECTORS, atol=1e-14)
    np.testing.assert_allclose(turned(within_half_a_turn(a), v), expected, atol=1e-14)
    assert float(jnp.linalg.norm(within_half_a_turn(a), axis=1).max()) <= np.pi + 1e-12
    on = Rotation.from_rotvec(others).apply(VECTORS)
    np.testing.assert_allclose(turned_on(a, jnp.asarray(others), turned(a, v)), on, atol=1e-13)
    one = turned(a[0], v)
    np.testing.assert_allclose(one, Rotation.from_rotvec(angles[0]).apply(VECTORS), atol=1e-14)


@pytest.mark.parametrize("size", SIZES)
def test_angles_change_as_a_spin_turns(size):
    angles, step = of_size(size), 1e-6
    rate = np.asarray(angle_rate(jnp.asarray(angles), jnp.asarray(VECTORS)))
    ends = [
        (Rotation.from_rotvec(s * VECTORS) * Rotation.from_rotvec(angles)).as_matrix()
        - Rotation.from_rotvec(angles + s * rate).as_matrix()
        for s in (step, -step)
    ]
    np.testing.assert_allclose((ends[0] - ends[1]) / (2.0 * step), 0.0, atol=1e-8)


@pytest.mark.parametrize("size", [0.0, 0.0999, 0.1001, 2.0])
def test_turns_have_derivatives(size):
    """At no turn at all, where |a| has none, as well."""
    a, v = (jnp.asarray(x[0]) for x in (of_size(size), VECTORS))

    def told(a):
        return jnp.concatenate([turned(a[None], v[None]), angle_rate(a[None], v[None])], axis=1)[0]

    slopes = jax.jacfwd(told)(a)
    np.testing.assert_allclose(jax.jacrev(told)(a), slopes, atol=1e-13)
    ends = [told(a + s * step) for step in 1e-5 * jnp.eye(3) for s in (1.0, -1.0)]
    differences = [(up - down) / 2e-5 for up, down in zip(ends[::2], ends[1::2], strict=True)]
    np.testing.assert_allclose(slopes, np.stack(differences, axis=1), atol=1e-8)


def test_turns_about_the_third_axis_are_those_in_the_plane():
    angle, plane = 0.7, jnp.asarray(VECTORS[:, :2])
    up, flat = jnp.asarray([0.0, 0.0, angle]), jnp.asarray(VECTORS * [1.0, 1.0, 0.0])
    for function in (turned, across):
        np.testing.assert_allclose(
            function(up, flat)[:, :2], function(jnp.asarray(angle), plane), atol=1e-15
        )


# ------------------------------------------------------------------ tops


def spun(inertia, spin, time, steps):
    """Angle and spin of a free top after a time, by steps of the loop's RK4."""
    matrix = jnp.asarray(inertia)[None]
    dt = time / steps

    def rates(y):
        angle, spin = y
        none = jnp.zeros_like(spin)
        return jnp.stack([angle_rate(angle, spin), spin_rate(angle, spin, none, matrix)])

    def step(_, y):
        k1 = rates(y)
        k2 = rates(y + 0.5 * dt * k1)
        k3 = rates(y + 0.5 * dt * k2)
        y = y + dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + rates(y + dt * k3))
        return jnp.stack([within_half_a_turn(y[0]), y[1]])

    start = jnp.stack([jnp.zeros((1, 3)), jnp.asarray(spin)[None]])
    return np.array(jax.jit(lambda y: jax.lax.fori_loop(0, steps, step, y))(start))[:, 0]


def test_a_symmetric_top_goes_round_its_angular_momentum():
    """R = exp(t |L| / I_1 L / |L|) exp(t w_3 (1 - I_3 / I_1) e_3), over several turns, with errors
    that fall to the fourth order."""
    inertia, spin, time = np.diag([1.0, 1.0, 1.8]), np.array([2.0, 0.0, 3.0]), 7.0
    momentum = inertia @ spin
    about, own = time * momentum, time * spin[2] * (1.0 - 1.8) * np.array([0.0, 0.0, 1.0])
    expected = Rotation.from_rotvec(about) * Rotation.from_rotvec(own)
    errors = []
    for steps in (400, 800):
        angle, late = spun(inertia, spin, time, steps)
        apart = Rotation.from_rotvec(angle).inv() * expected
        errors.append(apart.magnitude())
        own_spin = expected.inv().apply(late)
        assert own_spin[2] == pytest.approx(3.0, abs=10.0 * errors[-1])
    assert errors[1] < 1e-5
    assert 3.7 < np.log2(errors[0] / errors[1]) < 4.5


def test_a_tumbling_top_keeps_energy_and_angular_momentum():
    """Three moments of inertia in axes of no body's own, started about the middle one."""
    axes = Rotation.from_rotvec([0.3, -0.8, 0.5]).as_matrix()
    inertia = axes @ np.diag([1.0, 2.0, 3.0]) @ axes.T
    spin = 2.0 * axes[:, 1] + 0.01 * axes[:, 0]
    angle, late = spun(inertia, spin, 6.0, 3000)
    turn = Rotation.from_rotvec(angle).as_matrix()
    there = turn @ inertia @ turn.T
    np.testing.assert_allclose(there @ late, inertia @ spin, atol=1e-9)
    assert late @ there @ late == pytest.approx(spin @ inertia @ spin, rel=1e-10)
    assert (turn @ axes[:, 1]) @ axes[:, 1] < 0.0  # it has turned over


@pytest.mark.parametrize("size", [1e-14, 1e13])
def test_beads_and_ships_spin_in_single_precision(size):
    """Of moments of inertia whose cubes it does not have."""
    one = jnp.ones((1, 3), jnp.float32)
    inertia = jnp.asarray(np.diag([1.0, 1.5, 2.0])[None] * size, jnp.float32)
    rate = spin_rate(0.1 * one, 0.0 * one, size * one, inertia)
    assert rate.dtype == jnp.float32
    axes = Rotation.from_rotvec(0.1 * np.ones(3)).as_matrix()
    expected = axes @ np.diag([1.0, 1.0 / 1.5, 0.5]) @ axes.T @ np.ones(3)
    np.testing.assert_allclose(rate[0], expected, rtol=1e-5)
