"""Flow in at one end and out at the other."""

import numpy as np
import pytest

from jaxsph import run_scene
from jaxsph.scenes import channel_cylinder, poiseuille_open
from jaxsph.scenes.poiseuille_open import LENGTH, MEAN
from jaxsph.scenes.record import scene_from_record

ENDS = [pytest.param(("fringe", 2.0), marks=pytest.mark.slow), ("openings", 4.0)]


@pytest.fixture(scope="module", params=ENDS, ids=str)
def flow(request):
    ends, end_time = request.param  # through openings a plug's start rings for longer
    scene = poiseuille_open(16, ends=ends, end_time=end_time)
    return scene, run_scene(scene)


def test_plug_becomes_the_exact_profile(flow):
    scene, trajectory = flow
    position, velocity = trajectory.position[-1], trajectory.velocity[-1]
    exact, _ = scene.exact(position, trajectory.time[-1])
    inside = (position[:, 0] > 0.0) & (position[:, 0] < LENGTH)
    error = np.linalg.norm((velocity - exact)[inside]) / np.linalg.norm(exact[inside])
    assert error < 5e-3  # half of it compressibility; the plug was off by 0.41


def test_pressure_falls_as_it_must(flow):
    scene, trajectory = flow
    late = trajectory.time > 0.5 * trajectory.time[-1]
    x, p = trajectory.position[late][..., 0].ravel(), trajectory.pressure[late].ravel()
    middle = (x > 0.25 * LENGTH) & (x < 0.75 * LENGTH)
    slope = np.polyfit(x[middle], p[middle], 1)[0]
    assert slope == pytest.approx(-0.8, rel=0.05)  # -8 nu rho0 U / H^2; sound still goes round


def test_what_flows_in_flows_out(flow):
    """Particles that pass a section, counted over the second half of the run."""
    _, trajectory = flow
    late = trajectory.time > 0.5 * trajectory.time[-1]
    x, u = trajectory.position[late][..., 0], trajectory.velocity[late][..., 0]
    fluxes = []
    for start in np.linspace(0.0, LENGTH, 4, endpoint=False):
        there = (x >= start) & (x < start + LENGTH / 4)
        fluxes.append(u[there].sum() / there.sum())
    np.testing.assert_allclose(fluxes, MEAN, rtol=0.01)
    assert np.mean(fluxes) == pytest.approx(MEAN, rel=5e-3)


def test_cylinder_in_a_channel_has_its_force_recorded():
    scene = channel_cylinder(33, end_time=0.02)
    trajectory = run_scene(scene)
    assert set(trajectory.forces) == {"walls", "cylinder"}
    assert trajectory.forces["cylinder"][-1, 0] > 0.0
    (part,) = scene.walls.parts
    assert (part.reference_length, part.reference_speed) == (0.1, 0.2)
    again = scene_from_record(scene.name, scene.parameters)
    np.testing.assert_array_equal(again.state.velocity, scene.state.velocity)


@pytest.mark.parametrize(
    "settings, message",
    [({"reynolds": 0.0}, "reynolds: must be positive"), ({"resolution": 12}, "thinner than twice")],
)
def test_bad_settings_are_refused(settings, message):
    with pytest.raises(ValueError, match=message):
        channel_cylinder(**settings)
