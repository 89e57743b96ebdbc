"""The scenes of one's own that a page shows: short, and the flows that they say they are."""

import ast

import numpy as np
import pytest

from jaxsph import run_scene
from jaxsph.cli import main
from jaxsph.io import read_trajectory
from jaxsph.scenes.plane_flow_solution import poiseuille
from tests.docs.test_pages import ROOT, blocks

BLOCKS = blocks(ROOT / "docs" / "extend.md", "python")


@pytest.fixture(scope="module")
def shown():
    """What the page defines, without its runs."""
    names = {}
    for block in BLOCKS:
        exec(block.partition("\ntrajectory = ")[0], names)
    return names


def test_a_scene_takes_ten_lines():
    made = [node for block in BLOCKS for node in ast.parse(block).body
            if isinstance(node, ast.FunctionDef)]  # fmt: skip
    assert [node.name for node in made] == ["channel", "swirl", "tunnel"]
    assert all(node.end_lineno - node.lineno + 1 <= 10 for node in made)


def test_the_channel_flows_as_it_should(shown):
    viscosity, force = 0.1, -0.5  # others than its defaults
    run = run_scene(shown["channel"](viscosity, force))
    exact = poiseuille(run.position[-1, :, 1], run.time[-1], viscosity, force)
    apart = np.linalg.norm(run.velocity[-1, :, 0] - exact) / np.linalg.norm(exact)
    assert apart < 0.03  # 24 particles across


def test_the_command_line_runs_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my_scene.py").write_text(BLOCKS[0].partition("\ntrajectory = ")[0])
    assert main(["run", "my_scene.py:channel", "--set", "force=0.3"]) == 0
    found = read_trajectory(tmp_path / "out" / "channel" / "trajectory.h5")
    assert found.metadata["parameters"]["force"] == 0.3


@pytest.mark.slow
def test_a_drawn_body_is_dragged_along_and_not_to_a_side(shown):
    force = run_scene(shown["tunnel"]()).forces["ellipse"]
    assert (force[1:, 0] > 0.03).all()  # a body force of 0.5 m/s^2 has just set the fluid going
    np.testing.assert_allclose(force[:, 1], 0.0, atol=1e-10)
