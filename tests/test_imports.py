"""No module of a package imports, by whatever way round, a module that imports it."""

import ast
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
# methods by which a value is drawn or stored import, when called, what is made for such values
WHEN_CALLED = {
    ("jaxsph.trajectory", "jaxsph.plotting"),
    ("jaxsph.trajectory", "jaxsph.io"),
    ("jaxsph_rom.points.prediction.trained_model", "jaxsph_rom.points.files"),
}


def is_for_types(node) -> bool:
    return isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"


def statements(tree):
    """All nodes of a module, those within functions too, but for what only type checkers read."""
    for node in ast.iter_child_nodes(tree):
        if not is_for_types(node):
            yield node
            yield from statements(node)


def imported(text: str, package: str, known: set[str]):
    """Dotted names that a module of a package asks for: of `from a import b` a.b if it is known
    as a module, else a."""
    for node in statements(ast.parse(text)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            parts = package.split(".")
            above = parts[: len(parts) - node.level + 1] if node.level else []
            base = ".".join([*above, *filter(None, [node.module])])
            names = (f"{base}.{alias.name}" for alias in node.names)
            yield from (name if name in known else base for name in names)


def graph(files: dict[str, str]) -> dict[str, set[str]]:
    """What each module imports, by name; texts by names, packages' ending in `.__init__`.

    Importing a module runs the packages above it, but for those that hold the importer as well:
    they are being run already.
    """
    known, found = {name.removesuffix(".__init__") for name in files}, {}
    for name, text in files.items():
        module, package = name.removesuffix(".__init__"), name.rpartition(".")[0]
        asked = set()
        for wanted in imported(text, package, known):
            parts = wanted.split(".")
            run = {".".join(parts[: k + 1]) for k in range(len(parts))}
            around = {p for p in run - {wanted} if f"{module}.".startswith(f"{p}.")}
            asked |= run - around
        found[module] = (asked & known) - {module}
    return found


def sources(package: str) -> dict[str, str]:
    return {
        ".".join(path.relative_to(ROOT).with_suffix("").parts): path.read_text(encoding="utf-8")
        for path in (ROOT / package).rglob("*.py")
    }


@pytest.mark.parametrize("package", ["jaxsph", "jaxsph_rom"])
def test_no_import_goes_round(package):
    found = graph(sources(package))
    for module, called in WHEN_CALLED:
        asked = found.get(module, set())
        asked -= {name for name in asked if f"{name}.".startswith(f"{called}.")}
    assert sum(map(len, found.values())) > 2 * len(found) > 80  # the walk sees them
    tuple(TopologicalSorter(found).static_order())  # raises CycleError, which names the circle


def test_no_benchmark_imports_another():
    files = sources("benchmarks")
    scripts = {name for name, text in files.items() if 'if __name__ == "__main__":' in text}
    assert len(scripts) > 25
    asked = graph(files)
    assert not {name: asked[name] & scripts for name in scripts if asked[name] & scripts}


@pytest.mark.parametrize(
    "first",
    [
        "from .b import thing",
        "from . import b",
        "import p.b",
        "def later():\n    from .b import thing",
        "class A:\n    def later(self):\n        import p.b as b",
    ],
)
def test_a_circle_is_found(first):
    files = {"p.__init__": "", "p.a": first, "p.b": "from p.c import x", "p.c": "from .a import y"}
    with pytest.raises(CycleError):
        tuple(TopologicalSorter(graph(files)).static_order())
    files["p.c"] = ""
    assert tuple(TopologicalSorter(graph(files)).static_order())


def test_a_package_run_on_the_way_counts():
    files = {
        "p.__init__": "",
        "p.a.__init__": "from .one import x",
        "p.a.one": "from ..b.two import y",
        "p.b.__init__": "from ..a import x",
        "p.b.two": "",
    }
    with pytest.raises(CycleError):
        tuple(TopologicalSorter(graph(files)).static_order())
