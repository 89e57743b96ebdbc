"""Figures by which runs are judged, on signals that are known."""

import numpy as np
import pytest

from benchmarks.references.lid_driven_cavity import constant_lid, solve
from jaxsph import Trajectory
from jaxsph.metrics import local_quadratic, phase_error, surface_height
from jaxsph.scenes import hydrostatic_tank, standing_wave


def test_a_wave_that_is_ahead():
    time, place = np.linspace(0.0, 2.0, 201), np.linspace(0.0, 1.0, 7)

    def wave(ahead):
        phase = 2.0 * np.pi * (3.0 * time[:, None] - place[None, :]) + np.radians(ahead)
        return 0.4 + np.sin(phase)

    degrees, frequency = phase_error(time, wave(0.0), wave(25.0))
    assert degrees == pytest.approx(25.0, abs=0.5) and frequency == pytest.approx(3.0, abs=0.1)
    assert phase_error(time, wave(0.0), wave(-40.0))[0] == pytest.approx(-40.0, abs=0.5)
    assert phase_error(time, wave(10.0), wave(10.0))[0] == pytest.approx(0.0, abs=1e-9)


def test_what_is_steady_has_no_phase():
    time = np.linspace(0.0, 1.0, 11)
    with pytest.raises(ValueError, match="does not oscillate"):
        phase_error(time, np.full((11, 2), 3.0), np.ones((11, 2)))


def test_a_phase_needs_even_times():
    with pytest.raises(ValueError, match="four evenly spaced times"):
        phase_error(np.array([0.0, 1.0, 2.0, 4.0]), np.zeros((4, 1)), np.zeros((4, 1)))


@pytest.mark.parametrize("make", [standing_wave, hydrostatic_tank])
def test_a_gauge_sees_columns_that_were_stretched(make):
    """Heights H (1 + e cos k x) of columns a spacing apart, at periodic faces and at walls."""
    scene, stretched, k = make(40), 0.1, np.pi
    start = np.asarray(scene.state.position)
    share = 1.0 + stretched * np.cos(k * start[:, 0])
    position = (start * np.stack([np.ones_like(share), share], axis=1))[None]
    density = (1000.0 / share)[None]
    run = Trajectory(np.zeros(1), position, 0.0 * position, density, density)
    for gauge in (0.0, 0.3, 1.0):
        seen = stretched * np.exp(-0.5 * (k * scene.space.spacing) ** 2) * np.cos(k * gauge)
        found = surface_height(run, scene, gauge)
        np.testing.assert_allclose(found, [1.0 + seen], atol=1e-8)


@pytest.mark.parametrize(
    ("gauge", "width", "message"),
    [(3.0, None, "gauge: 3 m is outside"), ((0.1, 0.1), None, "gauge: 1 horizontal"),
     (0.1, 0.0, "width: must be positive")],
)  # fmt: skip
def test_gauges_that_see_nothing_are_named(gauge, width, message):
    scene = hydrostatic_tank(20)
    state = scene.state
    run = Trajectory(np.zeros(1), state.position[None], state.velocity[None], state.density[None],
                     state.density[None])  # fmt: skip
    with pytest.raises(ValueError, match=message):
        surface_height(run, scene, gauge, width)


def test_quadratic_fits_are_exact_for_quadratic_fields():
    rng = np.random.default_rng(0)
    position, points = rng.uniform(size=(400, 3)), rng.uniform(size=(5, 3))

    def field(x):
        return 1.0 + x @ [2.0, -1.0, 0.5] + x[:, 0] * x[:, 1] - 3.0 * x[:, 2] ** 2

    found = local_quadratic(points, position, field(position), 0.5)
    np.testing.assert_allclose(found, field(points), atol=1e-9)
    with pytest.raises(ValueError, match="a quadratic needs 10"):
        local_quadratic(points, position, field(position), 0.05)


@pytest.mark.parametrize(("side", "most"), [(32, 0.4), (50, 0.25), (100, 0.05)])
def test_the_probe_of_the_cavity_has_little_of_the_error_it_judges(side, most):
    """On the exact flow at Re = 400, percent of the lid's speed; linear fits have 4, 2.5, 0.7."""
    exact, at = solve(400.0, constant_lid), np.linspace(0.02, 0.98, 25)
    axis = (np.arange(side) + 0.5) / side
    position = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1).reshape(-1, 2)
    velocity, middle = exact.velocity(position), 0.0 * at + 0.5
    for points, component in ((np.stack([middle, at], 1), 0), (np.stack([at, middle], 1), 1)):
        found = local_quadratic(points, position, velocity[:, component], 3.0 / side)
        apart = np.abs(found - exact.velocity(points)[:, component])
        assert 100.0 * apart.max() < most
