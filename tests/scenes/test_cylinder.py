"""A cylinder in a uniform stream."""

import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import WallForces, run_scene
from jaxsph.scenes import cylinder
from jaxsph.scenes.record import scene_from_record

NARROW = {"upstream": 1.5, "downstream": 2.0, "width": 2.0}


@pytest.mark.slow
def test_a_stream_pulls_at_a_cylinder_and_comes_round_as_it_was():
    scene = cylinder(8, 50.0, end_time=0.3, h_over_dx=1.3, **NARROW)
    trajectory = run_scene(scene)
    drag, _ = trajectory.mean_forces["cylinder"][-1]
    assert 1.0 < drag < 10.0  # N: started at once, half the stream blocked
    (part,) = scene.walls.parts
    assert (part.reference_length, part.reference_speed) == (1.0, 1.0)
    held = np.asarray(scene.state.position[:, 0]) > 3.5 + 0.5 * 3.0
    np.testing.assert_allclose(trajectory.velocity[-1][held][:, 0].mean(), 1.0, rtol=0.02)


def test_it_is_made_again_from_its_record():
    scene = cylinder(8, 50.0, h_over_dx=1.3, end_time=0.3, **NARROW)
    again = scene_from_record(scene.name, scene.parameters)
    np.testing.assert_array_equal(again.state.velocity, scene.state.velocity)
    assert again.space == scene.space


def test_wake_is_kicked_once_behind_the_cylinder():
    scene = cylinder(8, 50.0, h_over_dx=1.3, end_time=0.3, **NARROW)
    place = jnp.asarray([[NARROW["upstream"] + 1.5, 0.0]])
    near = jnp.argmin(jnp.sum((scene.state.position - place) ** 2, axis=1))
    along, across = scene.state.velocity[near]
    assert float(along) == 1.0
    assert float(across) == pytest.approx(0.3, rel=0.05)


@pytest.mark.parametrize(
    "settings, message",
    [
        ({"reynolds": -1.0}, "reynolds: must be positive"),
        ({"width": 1.5}, "width: at least 2 m"),
        ({"width": np.inf}, "width: at least 2 m and finite"),
        ({"upstream": 0.4}, "upstream: at least 1 m"),
        ({"resolution": 4}, "thinner than twice"),
    ],
)
def test_bad_settings_are_refused(settings, message):
    with pytest.raises(ValueError, match=message):
        cylinder(**settings)


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_a_ghost_on_its_surface_is_the_cylinders_too(dtype):
    """As two are with seven to a diameter, in the middle of its front and of its back."""
    scene = cylinder(7, 40.0, upstream=2.0, downstream=2.0, width=3.0, dtype=dtype)
    measure, ghosts = WallForces.of(scene), np.float64(scene.walls.position)
    away = np.hypot(ghosts[:, 0] - 2.0, ghosts[:, 1])
    assert np.isclose(away, 0.5, atol=1e-6).any()
    assert measure.names == ("walls", "cylinder")
    assert measure.held.all() and measure.parts.all()
    forces, _ = measure(scene.model(), jnp.zeros((), dtype), scene.state)
    np.testing.assert_allclose(forces["cylinder"], forces["walls"], rtol=1e-6)
    assert forces["cylinder"][0] > 1.0  # N


def test_single_precision_goes_through():
    scene = cylinder(8, 50.0, h_over_dx=1.3, end_time=0.3, dtype="float32", **NARROW)
    assert scene.state.velocity.dtype == np.float32
