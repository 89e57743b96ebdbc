"""The examples in docstrings run, and show what they give."""

import ast
import doctest
import importlib
import re
import textwrap
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FILES = sorted(path for top in ("jaxsph", "jaxsph_rom") for path in (ROOT / top).rglob("*.py"))
DEFINITIONS = ast.Module | ast.ClassDef | ast.FunctionDef


def docstrings():
    """Module, name and docstring of all that has one."""
    for path in FILES:
        module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        for node in ast.walk(ast.parse(path.read_text())):
            text = ast.get_docstring(node) if isinstance(node, DEFINITIONS) else None
            if text:
                yield module, getattr(node, "name", ""), text


EXAMPLES = [(module, name, text) for module, name, text in docstrings() if ">>>" in text]


@pytest.mark.parametrize(
    "module, name, text", EXAMPLES, ids=[f"{module}.{name}" for module, name, _ in EXAMPLES]
)
def test_an_example_runs(module, name, text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    importlib.import_module(module)
    example = doctest.DocTestParser().get_doctest(text, {}, f"{module}.{name}", None, None)
    failures = []
    doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(example, out=failures.append)
    assert not failures, "".join(failures)


def test_newcomers_find_an_example():
    shown = {name for _, name, _ in EXAMPLES}
    assert shown >= {
        "simulate", "run_scene", "pod", "ReferenceSpace", "ReducedModel", "around",
        "relative_discrepancy",
    }  # fmt: skip


def test_code_in_docstrings_is_an_example_that_runs():
    """Equations stand in indented blocks, too, but are no Python."""
    idle = []
    for module, name, text in docstrings():
        for block in re.findall(r"\n\n((?:    .*\n?)+)", text):
            try:
                code = ast.parse(textwrap.dedent(block)).body
            except SyntaxError:
                continue
            if code:
                idle.append(f"{module}.{name}: {block}")
    assert not idle, "write it as `>>>` lines under `Examples:`:\n" + "\n".join(idle)


def test_docstrings_are_plain_markdown():
    """What looks like a tag vanishes from the site: `<u>` stands in an indented equation."""
    lost = []
    for module, name, text in docstrings():
        for paragraph in text.split("\n\n"):
            prose = re.sub(r"`[^`]*`", "", paragraph)
            hidden = name.startswith("_") or paragraph.startswith("    ")
            if not hidden and re.search(r"<[A-Za-z/]", prose):
                lost.append(f"{module}.{name}: {paragraph}")
    assert not lost, "\n".join(lost)
