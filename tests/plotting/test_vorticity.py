"""The curl of the velocity: exact where velocity is linear, near the exact one of a vortex."""

import numpy as np
import pytest

from jaxsph.plotting import FIELDS, vorticity
from jaxsph.trajectory import Snapshot, Trajectory

RNG = np.random.default_rng(0)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_linear_velocity_has_its_curl(dim):
    position, slope = RNG.random((300, dim)), RNG.normal(size=(dim, dim))
    turning = slope - slope.T  # velocity is x slope, so slope[a, b] = d u_b / d x_a
    wanted = turning[0, 1] if dim == 2 else np.sqrt(0.5 * (turning**2).sum())
    found = vorticity(position, position @ slope + 7.0)
    np.testing.assert_allclose(found, wanted, rtol=1e-6)


def test_a_vortex_has_its_own():
    errors = []
    for side in (20, 40):
        cells = (np.indices((side, side)).reshape(2, -1).T + 0.5) / side
        x = cells + RNG.normal(scale=0.1 / side, size=cells.shape)
        a, b = 2.0 * np.pi * x.T
        velocity = np.stack([np.cos(a) * np.sin(b), -np.sin(a) * np.cos(b)], axis=1)
        exact = -4.0 * np.pi * np.cos(a) * np.cos(b)
        errors.append(np.abs(vorticity(x, velocity) - exact).mean() / np.abs(exact).max())
    assert errors[0] < 0.05 and errors[1] < 0.5 * errors[0]


def test_particles_in_a_line_or_few_have_a_number():
    line = np.linspace(0.0, 1.0, 20)[:, None] * [1.0, 0.0]
    assert np.isfinite(vorticity(line, line[:, ::-1])).all()
    assert np.isfinite(vorticity(line[:2], line[:2])).all()
    assert np.isfinite(vorticity(np.zeros((5, 2)), RNG.normal(size=(5, 2)))).all()


def test_it_is_a_field_of_snapshots_and_of_runs():
    position, velocity = RNG.random((2, 30, 2)), RNG.normal(size=(2, 30, 2))
    ones = np.ones((2, 30))
    run = Trajectory(np.arange(2.0), position, velocity, ones, ones)
    found = FIELDS["vorticity"].value(run)
    assert found.shape == (2, 30)
    one = Snapshot(position[1], velocity[1], ones[1], ones[1])
    np.testing.assert_array_equal(found[1], FIELDS["vorticity"].value(one))
