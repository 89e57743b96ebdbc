"""Free bodies in files and pictures: what is kept of them, and where they are drawn."""

import dataclasses
import json

import h5py
import numpy as np
import pytest
from PIL import Image

from jaxsph import run_scene
from jaxsph.cli import main
from jaxsph.io import (
    BodyShapes,
    TrajectoryWriter,
    read_body_shapes,
    read_checkpoint,
    read_trajectory,
    read_walls,
    read_walls_of,
)
from jaxsph.plotting import animate
from jaxsph.report.film import film
from tests.walls.test_free_body import START, scene


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """A short run in a file, one that was killed and went on, and the scene."""
    folder = tmp_path_factory.mktemp("box")
    flow = dataclasses.replace(scene(), end_time=0.02, steps_per_snapshot=2)
    bare = {"measure": None, "averaged": None}
    whole = run_scene(flow, folder / "whole.h5", **bare)

    class Killed(Exception):
        pass

    def kill(steps, done=[0]):  # noqa: B006
        done[0] += steps
        if done[0] >= 4:
            raise Killed

    with pytest.raises(Killed):
        run_scene(flow, folder / "cut.h5", progress=kill, **bare)
    return folder, flow, whole, run_scene(flow, folder / "cut.h5", **bare)


@pytest.mark.run_once
def test_a_run_that_was_killed_goes_on_with_its_body(kept):
    folder, _, whole, again = kept
    assert np.ptp(whole.bodies.position[:, 0, 1]) > 1e-5 and whole.bodies.spin.shape == (6, 1)
    for name in ("position", "angle", "velocity", "spin"):
        np.testing.assert_array_equal(getattr(again.bodies, name), getattr(whole.bodies, name))
    np.testing.assert_array_equal(again.position, whole.position)
    assert read_checkpoint(folder / "cut.h5", 4).state.bodies.position.shape == (1, 2)
    with h5py.File(folder / "cut.h5", "r") as file:
        units = {name: part.attrs["unit"] for name, part in file["bodies"].items()}
    assert units == {"position": "m", "angle": "rad", "velocity": "m/s", "spin": "rad/s"}


@pytest.mark.run_once
def test_files_give_back_and_branch_from_the_body(kept):
    folder, _, whole, _ = kept
    whole.save(folder / "saved.h5")
    saved = read_trajectory(folder / "saved.h5")
    np.testing.assert_array_equal(saved.bodies.position, whole.bodies.position)
    with TrajectoryWriter.branch(folder / "whole.h5", folder / "branch.h5", 6) as writer:
        assert writer.last_step == 6
    branch = read_trajectory(folder / "branch.h5")
    np.testing.assert_array_equal(branch.bodies.spin, whole.bodies.spin[:4])
    np.testing.assert_array_equal(branch.state(-1).bodies.velocity, whole.bodies.velocity[3])


@pytest.mark.run_once
def test_a_body_is_drawn_where_it_is(kept):
    folder, flow, whole, _ = kept
    path = folder / "whole.h5"
    fixed, last = read_walls(path), whole.snapshot(-1)
    own = np.asarray(flow.walls.free.owner) == 0
    assert len(fixed) == (~own).sum()
    drawn = read_walls_of(path, last)
    expected = np.asarray(flow.walls.at(START, last.bodies).position)[own]
    np.testing.assert_allclose(drawn[len(fixed) :], expected, atol=1e-6)  # single precision
    shapes = BodyShapes.of(flow.walls)
    np.testing.assert_allclose(read_body_shapes(path).arm, shapes.arm, atol=1e-7)
    counts = [len(shapes.arm) + len(last.position)] * 6
    assert f'"counts": {counts}' in film(path)  # of a page, the body beside the particles
    with Image.open(animate(path, folder / "box.gif")) as picture:
        assert picture.n_frames == 6
    with Image.open(whole.animate(folder / "own.gif", shapes=shapes)) as picture:
        assert picture.n_frames == 6


@pytest.mark.run_once
def test_show_tells_where_it_is(kept, capsys):
    folder, _, whole, _ = kept
    assert main(["show", str(folder / "whole.h5"), "--json", str(folder / "told.json")]) == 0
    printed = capsys.readouterr().out
    x, y = whole.bodies.position[-1, 0]
    assert f"at ({x:.5g}, {y:.5g}) m, turned by" in printed
    told = json.loads((folder / "told.json").read_text())["bodies"][0]
    assert told["position"] == pytest.approx([x, y]) and told["highest"][1] >= told["lowest"][1]
