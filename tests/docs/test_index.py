"""What users are shown is what the packages hand on: the index of the documentation."""

import ast
import importlib
import json
from pathlib import Path

import pytest

from tests.docs.test_pages import PAGES, ROOT, blocks

MODULES = {"jaxsph.metrics", "jaxsph.environment"}  # that users import as they are
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))


def packages():
    tops = ("jaxsph", "jaxsph_rom")
    inits = [path for top in tops for path in ROOT.glob(f"{top}/**/__init__.py")]
    return {".".join(init.parent.relative_to(ROOT).parts): init for init in sorted(inits)}


def handed_on(init: Path) -> set[str]:
    """Names that a package's `__init__` gives: imported as themselves, or defined."""
    names = set()
    for node in ast.parse(init.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ImportFrom):
            names |= {alias.name for alias in node.names if alias.asname == alias.name}
        elif isinstance(node, ast.Assign):
            names |= {target.id for target in node.targets}
    return names


def shown():
    """Place and Python of all that users are shown."""
    for page in (*PAGES, ROOT / "CONTRIBUTING.md"):
        yield from ((page.name, text) for text in blocks(page, "python"))
    for notebook in NOTEBOOKS:
        for cell in json.loads(notebook.read_text(encoding="utf-8"))["cells"]:
            if cell["cell_type"] == "code":
                lines = "".join(cell["source"]).splitlines()
                code = "\n".join(line for line in lines if not line.lstrip().startswith("%"))
                yield notebook.name, code


def asked(code: str):
    """Our modules that a piece of code imports, each with the name taken from it."""
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.ImportFrom) and node.module.partition(".")[0].startswith("jaxsph"):
            yield from ((node.module, alias.name) for alias in node.names)


@pytest.mark.parametrize("package", packages())
def test_what_a_package_hands_on_is_there(package):
    module = importlib.import_module(package)
    missing = [name for name in handed_on(packages()[package]) if not hasattr(module, name)]
    assert not missing


def test_nobody_is_shown_an_inner_module():
    index = {package: handed_on(init) for package, init in packages().items()}
    index |= {module: vars(importlib.import_module(module)) for module in MODULES}
    pieces = list(shown())
    found = [(place, module, name) for place, code in pieces for module, name in asked(code)]
    assert len(pieces) > 60 and len(found) > 30  # they are read
    assert not [one for one in found if one[2] not in index.get(one[1], ())]


def test_an_inner_module_would_be_found():
    assert list(asked("from jaxsph.pairs import Space")) == [("jaxsph.pairs", "Space")]
    assert "jaxsph.pairs" not in packages()
