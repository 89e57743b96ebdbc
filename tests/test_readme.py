"""What the README shows runs as it stands."""

import re
from pathlib import Path

README = Path(__file__).parents[1] / "README.md"


def test_the_python_examples_run(capsys):
    flow, vessel = re.findall(r"```python\n(.*?)```", README.read_text(), flags=re.DOTALL)
    exec(compile(flow, "README.md", "exec"), {})
    shown = capsys.readouterr().out
    names = {}
    exec(compile(vessel, "README.md", "exec"), names)
    distance = ((names["walls"].position - 1.0) ** 2).sum(axis=1) ** 0.5
    assert float(distance.min()) >= 1.0 and float(distance.max()) < 1.2  # four layers of dx
    assert "ConsistentViscosity" in shown and "576, 2" in shown
    assert float(shown.split()[-1]) < 0.0  # viscosity takes energy from the flow


def test_its_commands_are_the_ones_that_ci_runs():
    text = README.read_text()
    assert "python -m pip install -e . && jaxsph-rom run taylor-green" in text
    assert 'python -m pip install -e ".[test]" && python -m pytest' in text
    ci = (README.parent / ".ci" / "run").read_text()
    assert 'python -m pip install -e ".[test]" && python -m pytest' in ci
