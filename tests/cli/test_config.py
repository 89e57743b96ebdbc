"""`--config run.toml`: every run leaves what runs it again."""

import json
import subprocess
import sys
import tomllib
from importlib.metadata import EntryPoint, EntryPoints
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import jaxsph
from jaxsph.cli import main, scene_functions
from jaxsph.io import read_trajectory
from jaxsph_command import commands, scenes
from jaxsph_command.config import expanded, typed

OWN = """
import jaxsph

def drop(amplitude: float = 0.01, resolution: int = 16):
    return jaxsph.scenes.taylor_green(resolution, end_time=0.02, time_step=0.01,
        arrangement=jaxsph.arrangements.JitteredLattice(amplitude))
"""


@pytest.fixture(autouse=True)
def in_empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))


def test_a_run_is_repeated_by_what_it_leaves(tmp_path):
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "scene.py").write_text(OWN)
    run = ["run", "own/scene.py:drop", "--resolution", "12", "--amplitude=0.05"]
    assert main([*run, "--steps", "fixed", "--out", "first"]) == 0
    kept = tomllib.loads(Path("first/run.toml").read_text())
    assert kept == {"command": "run", "scene": "../own/scene.py:drop", "resolution": 12,
                    "amplitude": 0.05, "steps": "fixed"}  # fmt: skip
    assert main(["run", "--config", "first/run.toml", "--out", "second"]) == 0
    first, second = (read_trajectory(f"{name}/trajectory.h5") for name in ("first", "second"))
    np.testing.assert_array_equal(first.position, second.position)
    assert tomllib.loads(Path("second/run.toml").read_text())["resolution"] == 12
    # what is given after it counts
    changed = ["run", "--config=first/run.toml", "--out", "third", "--amplitude", "0"]
    assert main(changed) == 0
    assert not np.array_equal(first.position, read_trajectory("third/trajectory.h5").position)


@pytest.mark.parametrize(
    "program, words",
    [
        ("jaxsph", ["run", "dam-break", "--column", "0.1", "0.2", "--set", "tank=(0.5, 0.4)",
                    "--alpha=1e-3", "--seed", "3"]),
        ("jaxsph", ["sweep", "taylor-green", "--reynolds", "100:200:3", "400"]),
        ("jaxsph-rom", ["train", "taylor-green", "--train", "100", "mach=0.1,0.2"]),
        ("jaxsph-rom", ["run", "open-cavity", "--slice", "0.2"]),
        ("jaxsph-rom", ["run", "taylor-green", "--gauge", "--predict", "150", "--tau", "auto"]),
    ],
)  # fmt: skip
def test_words_come_back_from_the_file(tmp_path, program, words):
    from jaxsph_command.config import write_config

    given = typed(commands.parser(program, words).chosen, words[1:])
    options = SimpleNamespace(typed=given, program=program, name=words[0])
    write_config(tmp_path / "run.toml", options)
    again = expanded([words[0], "--config", str(tmp_path / "run.toml")])
    assert vars(commands.parser(program, again).parse_args(again)) == vars(
        commands.parser(program, words).parse_args(words)
    ) | {"make": commands.parser(program, again).parse_args(again).make}


def test_scenes_of_other_packages(monkeypatch, capsys):
    point = EntryPoint("vortex-of-mine", "jaxsph.scenes:taylor_green", scenes.GROUP)
    point = SimpleNamespace(name=point.name, value=point.value, load=point.load,
                            dist=SimpleNamespace(name="mine"))  # fmt: skip

    class Points(EntryPoints):
        names = {point.name}

        def __getitem__(self, name):
            return point

    for module in (scenes, scene_functions):
        monkeypatch.setattr(module, "entry_points", lambda group: Points([point]))
    assert main(["scenes"]) == 0
    assert "vortex-of-mine: jaxsph.scenes:taylor_green of mine" in capsys.readouterr().out
    assert main(["run", "vortex-of-min"]) == 2
    assert "did you mean vortex-of-mine?" in capsys.readouterr().err
    run = ["run", "vortex-of-mine", "--resolution", "12", "--t-end", "0.02", "--reynolds", "50"]
    assert main([*run, "--arrangement", "lattice", "--json", "r.json"]) == 0
    assert json.loads(Path("r.json").read_text())["parameters"]["reynolds"] == 50.0
    assert Path("out/vortex-of-mine/run.toml").is_file()


@pytest.mark.parametrize("words, most", [(["--help"], 0.3), (["scenes"], 1.0)])
@pytest.mark.parametrize("program", ["jaxsph", "jaxsph_rom"])
def test_help_and_scenes_wait_for_no_import(program, words, most):
    """Processor seconds, the interpreter's start in them."""
    if program == "jaxsph_rom" and words == ["scenes"]:
        pytest.skip("a command of the other program")
    script = (
        f"import sys, time; sys.argv[1:] = {words}; import jaxsph_command\n"
        "try: jaxsph_command.{}()\n"
        "except SystemExit: pass\n"
        "assert 'jax' not in sys.modules and 'numpy' not in sys.modules\n"
        "print(time.process_time())"
    ).format(program)
    root = str(Path(jaxsph.__file__).parents[1])
    done = subprocess.run(
        [sys.executable, "-c", script], env={"PYTHONPATH": root}, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert 0.0 < float(done.stdout.splitlines()[-1]) < most
