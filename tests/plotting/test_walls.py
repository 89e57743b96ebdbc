"""Walls are drawn where they are: kept in the file, grey, and the whole tank in view."""

import dataclasses

import numpy as np
import pytest

from jaxsph.io import TrajectoryWriter, read_snapshot, read_walls
from jaxsph.plotting import animate, snapshot_figure
from jaxsph.plotting.style import WALL
from jaxsph.scenes import dam_break, hydrostatic_tank, piston_wave_maker
from jaxsph.trajectory import Snapshot
from tests.runs import random_run


def written(path, scene, steps=(0, 1)):
    """A file of a scene that holds its start as often as wanted."""
    state = scene.state
    snapshot = Snapshot(*map(np.asarray, (state.position, state.velocity, state.density)),
                        np.asarray(scene.fluid.pressure(state.density)))  # fmt: skip
    with TrajectoryWriter.create(path, scene) as writer:
        for k in steps:
            step = k * scene.steps_per_snapshot
            writer.append(step, step * scene.time_step, snapshot)
    return path


@pytest.fixture(scope="module")
def tank():
    return dam_break(30)


def test_the_file_keeps_them_through_resuming_and_branching(tmp_path, tank):
    path = written(tmp_path / "t.h5", tank)
    np.testing.assert_allclose(read_walls(path), tank.walls.position, rtol=1e-6)
    TrajectoryWriter.append_to(path).close()
    TrajectoryWriter.branch(path, tmp_path / "b.h5", 0).close()
    for kept in (path, tmp_path / "b.h5"):
        np.testing.assert_allclose(read_walls(kept), tank.walls.position, rtol=1e-6)
    assert read_walls(random_run(tmp_path / "open.h5")) is None


def test_a_body_that_moves_is_left_out():
    scene = piston_wave_maker(60)
    fixed = scene.walls.fixed_position
    assert 0 < len(fixed) < len(scene.walls.position)
    still = dataclasses.replace(scene, walls=dataclasses.replace(scene.walls, bodies=None))
    assert len(still.walls.fixed_position) == len(scene.walls.position)


def test_a_dam_break_is_drawn_in_its_tank(tmp_path, tank):
    path = written(tmp_path / "t.h5", tank)
    figure = snapshot_figure(*read_snapshot(path), walls=read_walls(path))
    for axes in [axes for axes in figure.axes if axes.get_title()]:
        fluid, walls = axes.collections
        assert walls.get_facecolor()[0] == pytest.approx([int(WALL[1:3], 16) / 255] * 3 + [1.0])
        assert len(walls.get_offsets()) == len(tank.walls.position)
        assert len(fluid.get_offsets()) == len(tank.state.position)
        assert axes.get_xlim()[1] > tank.space.box.upper[0] > tank.state.position[:, 0].max() + 0.1
        squares = [c.get_sizes()[0] for c in (fluid, walls)]
        assert squares[1] == pytest.approx(squares[0], rel=0.3)  # both as large as a spacing
    assert animate(path, tmp_path / "t.gif").stat().st_size > 1000


def test_in_three_dimensions_and_without_walls_nothing_is_added(tmp_path):
    path = random_run(tmp_path / "t.h5", dim=3)
    figure = snapshot_figure(*read_snapshot(path), walls=np.zeros((4, 3)))
    assert all(len(axes.collections) == 1 for axes in figure.axes if axes.get_title())
    closed = written(tmp_path / "c.h5", hydrostatic_tank(12), steps=(0,))
    assert read_walls(closed).shape[1] == 2
