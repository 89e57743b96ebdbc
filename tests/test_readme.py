"""What the README shows runs as it stands."""

import re
from pathlib import Path

from jaxsph.cli import main

README = Path(__file__).parents[1] / "README.md"


def test_the_python_examples_run(capsys):
    flow, vessel = re.findall(r"```python\n(.*?)```", README.read_text(), flags=re.DOTALL)
    exec(compile(flow, "README.md", "exec"), {})
    shown = capsys.readouterr().out
    names = {}
    exec(compile(vessel, "README.md", "exec"), names)
    distance = ((names["walls"].position - 1.0) ** 2).sum(axis=1) ** 0.5
    assert float(distance.min()) >= 1.0 and float(distance.max()) < 1.2  # four layers of dx
    assert "LaminarViscosity" in shown and "576, 2" in shown
    assert float(shown.split()[-1]) < 0.0  # viscosity takes energy from the flow


def test_the_commands_that_look_at_results_run(tmp_path, monkeypatch):
    """As they stand, but for the size of the run."""
    monkeypatch.chdir(tmp_path)
    part = README.read_text().partition("### Looking at results")[2]
    commands = re.search(r"```bash\n(.*?)```", part, flags=re.DOTALL)[1].splitlines()
    small = ["--resolution", "16", "--arrangement", "lattice"]
    for command in commands:
        program, *words = command.split()
        assert program == "jaxsph"
        assert main([*words, *(small if "run" in words and "--resume" not in words else [])]) == 0
    made = {path.name for path in Path("out/vortex").iterdir()}
    assert made == {
        "trajectory.h5", "report.html", "last.png", "trajectory.vtkhdf", "trajectory.gif"
    }  # fmt: skip
    assert {path.name for path in Path("out/again").iterdir()} == {"trajectory.h5", "report.html"}


def test_its_commands_are_the_ones_that_ci_runs():
    text = README.read_text()
    assert "python -m pip install -e . && jaxsph-rom run taylor-green" in text
    assert 'python -m pip install -e ".[test]" && python -m pytest' in text
    ci = (README.parent / ".ci" / "run").read_text()
    assert 'python -m pip install -e ".[test]" && python -m pytest' in ci
