"""Walls above the water line."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import run_scene
from jaxsph.effects import WallPressure, WettedWalls
from jaxsph.scenes import sloshing


def still():
    """The tank at rest."""
    scene = sloshing(20, end_time=0.6)
    effects = tuple(e for e in scene.effects if e.name != "MovingFrame")
    return dataclasses.replace(scene, effects=effects)


def test_ghosts_are_wet_below_the_water_line_and_dry_above():
    scene = still()
    neighbors = scene.search().build(scene.state.position)
    functional = scene.functional()
    ghosts = jax.jit(lambda state: functional.passes(jnp.zeros(()), state, neighbors)[2])(
        scene.state
    )
    position, particles = (np.asarray(a) for a in (ghosts["position"], scene.state.position))
    apart = np.linalg.norm(position[:, None] - particles[None], axis=2).min(axis=1)
    seen = apart < 0.9 * scene.space.support  # what others hold is never summed
    ghosts = {name: field[seen] for name, field in ghosts.items()}
    height = position[seen, 1]
    volume = np.asarray(ghosts["volume"]) / scene.space.spacing**2
    line, dx = 0.15, scene.space.spacing
    assert (np.asarray(ghosts["pressure"]) >= 0.0).all()
    np.testing.assert_allclose(volume[height < line - dx], 1.0, atol=0.02)
    np.testing.assert_array_equal(volume[height > line + dx], 0.0)


def test_the_column_beside_a_wall_stands():
    """The corner's particle settles by 1.6 mm, of a spacing of 28.5 mm, as all of the surface
    does; where walls are full above the water it sinks by 15.4 mm in the same time."""
    run = run_scene(still(), measure=None)
    corner = np.argmax(run.position[0, :, 1] - run.position[0, :, 0])
    assert run.position[0, corner, 1] - run.position[-1, corner, 1] < 0.0025
    assert np.abs(run.position[-1] - run.position[0]).max() < 0.0045  # 2.9 mm; 15.4 mm without


def test_walls_without_pressure_are_refused():
    scene = still()
    effects = tuple(e for e in scene.effects if not isinstance(e, WallPressure))
    effects = (WettedWalls(), *(e for e in effects if not isinstance(e, WettedWalls)))
    functional = dataclasses.replace(scene, effects=effects).functional()
    neighbors = scene.search().build(scene.state.position)
    with pytest.raises(ValueError, match="WettedWalls needs WallPressure before it"):
        functional(jnp.zeros(()), scene.state, neighbors)
