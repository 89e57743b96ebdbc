"""`jaxsph run my_scene.py:function --set name=value`: one's own scenes, and any setting."""

import sys

import jax
import numpy as np
import pytest

from jaxsph.arrangements import Lattice
from jaxsph.cli import main
from jaxsph.cli.scene_functions import scene_function
from jaxsph.cli.scene_options import scene_settings
from jaxsph.io import read_checkpoint, read_trajectory
from jaxsph.kernels import WendlandC4
from jaxsph.scenes import SCENES, dam_break, taylor_green
from jaxsph_command.commands import parser

OWN = '''
import equinox as eqx
import jaxsph
from beside import LATTICE

def swirl(speed, resolution=16, end_time=0.04):
    """A vortex at a speed of its own.

    Args:
        speed: of the fastest particle [m/s].
        resolution, end_time: particles a side,
            and how long [s].
    """
    same = {"arrangement": LATTICE, "time_step": 0.01}
    scene = jaxsph.scenes.taylor_green(resolution, end_time=end_time, **same)
    return eqx.tree_at(lambda s: s.state.velocity, scene, scene.state.velocity * speed)

def fails(speed=1.0):
    return {}[speed]

def nothing(speed=1.0):
    return None

def occupied(out=1, samples=2, modes=3, batch=4, devices=5, train=6, hyper=7, speed=1.0):
    return swirl(speed)
'''


@pytest.fixture(autouse=True)
def own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    (tmp_path / "beside.py").write_text("import jaxsph\nLATTICE = jaxsph.arrangements.Lattice()\n")
    (tmp_path / "my_scene.py").write_text(OWN)
    (tmp_path / "broken.py").write_text("import jaxsph\nx = 1 / 0\n")


def test_an_own_scene_runs_and_goes_on_as_itself(capsys):
    run = ["run", "my_scene.py:swirl", "--set", "speed=0.5"]
    assert main([*run, "--resolution", "12"]) == 0
    path = "out/swirl/trajectory.h5"
    first = read_trajectory(path)
    vortex = taylor_green(12, arrangement=Lattice()).state
    np.testing.assert_allclose(first.velocity[0], 0.5 * np.asarray(vortex.velocity), rtol=1e-12)
    resume = [*run[:2], "--resolution", "12", "--t-end", "0.08", "--resume", path]
    assert main([*resume, "--set", "speed=0.6"]) == 2
    assert "holds another run (state.velocity has other values)" in capsys.readouterr().err
    assert main([*resume, "--set", "speed=0.5"]) == 0
    found = read_trajectory(path)
    assert found.time[-1] == pytest.approx(0.08) and found.particles == 144
    np.testing.assert_array_equal(found.velocity[: len(first.time)], first.velocity)
    checkpoint = read_checkpoint(path)
    assert checkpoint.complete and checkpoint.content["end_time"] == "0.08"


@pytest.mark.parametrize(
    "arguments, message",
    [
        (["run", "dam-braek"], "'dam-braek' is not known (did you mean dam-break?)"),
        (["run", "nowhere.py"], "there is no file nowhere.py"),
        (["run", "broken.py"], "broken.py, line 2: ZeroDivisionError: division by zero"),
        (["run", "my_scene.py"], "has no function make; it has swirl, fails, nothing, occupied"),
        (["run", "my_scene.py:swril"], "no function swril (did you mean swirl?)"),
        (["run", "my_scene.py:swirl"], "missing 1 required positional argument: 'speed'"),
        (["run", "my_scene.py:fails"], "my_scene.py, line 19: KeyError: 1.0"),
        (["run", "my_scene.py:nothing"], "nothing gives NoneType; let it return a jaxsph Scene"),
        (["run", "my_scene.py:swirl", "--set", "sped=1"], "no sped (did you mean speed?)"),
        (["run", "my_scene.py:swirl", "--reynolds", "5"], "--reynolds: scene my_scene.py:swirl"),
        (["run", "dam-break", "--set", "tank"], "--set: give NAME=VALUE, got tank"),
        (["run", "dam-break", "--set", "kernel=WendlandC5"], "kernel: 'WendlandC5' is not known"),
        (["sweep", "my_scene.py:swirl", "--reynolds", "5"], "--reynolds: scene my_scene.py:swirl"),
    ],
)
def test_bad_input_is_one_line(capsys, tmp_path, arguments, message):
    assert main(arguments) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and message in error
    assert not (tmp_path / "out").exists()


def settings(*arguments):
    """What is given, by the words of the scene's function."""
    words = ["run", "dam-break", *arguments]
    options = parser("jaxsph", words).parse_args(words)
    return scene_settings(options, scene_function("dam-break"), "float64")


def test_any_setting_of_any_scene_can_be_given():
    assert settings("--column", "0.1", "0.2", "--alpha", "0.3")["column"] == [0.1, 0.2]
    given = settings("--set", "tank=(0.3, 0.2)", "--set", "kernel=WendlandC4", "--set", "alpha=0")
    assert given["tank"] == (0.3, 0.2) and given["kernel"] == WendlandC4() and given["alpha"] == 0
    assert settings("--set", "wall_velocity=FreeSlip")["wall_velocity"].name == "FreeSlip"
    assert jax.config.jax_enable_x64 and settings()["dtype"] == "float64"


@pytest.mark.parametrize(
    "program, command",
    [
        ("jaxsph", "run"),
        ("jaxsph", "sweep"),
        ("jaxsph-rom", "run"),
        ("jaxsph-rom", "train"),
        ("jaxsph-rom", "labels"),
    ],
)
def test_a_setting_of_a_taken_name_leaves_the_commands_option_alone(program, command):
    words = [command, "my_scene.py:occupied"]
    chosen = parser(program, words).chosen
    settings = chosen.get_default("settings")
    assert "speed" in settings.values() and "out" not in settings.values()
    assert chosen._option_string_actions["--out"].dest == "out"


def test_what_a_scene_can_be_given_is_told(capsys):
    assert main(["scenes", "my_scene.py:swirl"]) == 0
    lines = [line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines()]
    assert ["speed", "of the fastest particle [m/s]. (needed)"] in lines
    assert ["end_time", "particles a side, and how long [s]. (default: 0.04)"] in lines
    assert scene_function("dam-break") is dam_break
    for name in SCENES:
        assert main(["scenes", name]) == 0
        assert "[s]" in capsys.readouterr().out
