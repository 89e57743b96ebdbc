"""`jaxsph scenes`: what can be run, told from the sources without running them."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from .errors import Parser

GROUP = "jaxsph.scenes"  # entry points by which other packages offer scenes
SCALES = ("small", "half", "paper")


def add_to(parser: Parser, words: list[str]) -> None:
    """Add the command's options to its parser."""
    parser.description = (
        "List the scenes with their sizes, those of other packages that offer some by entry points "
        f"of the group {GROUP} as well. With --scale they are built, and their effects told."
    )
    parser.set_defaults(command=_list_scenes)
    parser.add_argument(
        "scene",
        nargs="?",
        metavar="SCENE",
        help="tell what this one can be given: a name, or my_scene.py:function",
    )
    parser.add_argument(
        "--scale", choices=SCALES, action="append", help="build scenes of these sizes"
    )
    parser.add_argument(
        "--json", type=_writable, metavar="FILE", help="write the results to FILE as well"
    )


def _writable(text: str) -> Path:
    from jaxsph.cli.options import writable  # needs JAX

    return writable(text)


def _list_scenes(options) -> int:
    if options.scene is not None or options.scale:
        from jaxsph.cli.scenes import tell_scenes  # needs JAX

        told = tell_scenes(options.scene, options.scale or ())
    else:
        told = _listed()
    if options.json is not None:
        from jaxsph.cli.options import write_json

        write_json(options.json, told)
    return 0


def _listed() -> dict[str, dict[str, Any]]:
    """Print all scenes and their sizes; what is printed by their names."""
    told: dict[str, dict[str, Any]] = {}
    for name, summary, scales in scenes():
        told[name] = {"summary": summary, "sizes": scales}
        print(f"{name}: {summary}")
        for scale, size in scales.items():
            print(
                f"  {scale:6} resolution {size['resolution']}, h/dx = {size['h_over_dx']:g}, "
                f"dt = {size['time_step']:g} s"
            )
    for point in entry_points(group=GROUP):
        told[point.name] = {"function": point.value, "package": point.dist.name}
        print(f"{point.name}: {point.value} of {point.dist.name}")
    return told


def scenes() -> Iterator[tuple[str, str, dict[str, dict[str, Any]]]]:
    """Name, summary and sizes of each scene, by reading its source."""
    folder = Path(find_spec("jaxsph").origin).parent / "scenes"
    package = _tree(folder / "__init__.py")
    files = {
        alias.name: node.module
        for node in package.body
        if isinstance(node, ast.ImportFrom) and node.module
        for alias in node.names
    }
    table = next(n.value for n in package.body if _assigned(n) == "SCENES")
    for key, value in zip(table.keys, table.values, strict=True):
        tree = _tree(folder / f"{files[value.id]}.py")
        functions = (n for n in tree.body if isinstance(n, ast.FunctionDef))
        (make,) = (n for n in functions if n.name == value.id)
        summary = " ".join((ast.get_docstring(make) or "").partition("\n\n")[0].split())
        summary = summary.partition("; ")[0].rstrip(":")
        yield key.value, summary, _sizes(folder, tree, make)


def _sizes(folder: Path, tree: ast.Module, make: ast.FunctionDef) -> dict[str, dict[str, Any]]:
    """The table of sizes that a scene's function names."""
    named = [n.id for n in ast.walk(make) if isinstance(n, ast.Name) and n.id.startswith("SCALES")]
    return _table(folder, tree, named[0] if named else "SCALES")


def _table(folder: Path, tree: ast.Module, name: str) -> dict[str, dict[str, Any]]:
    """A module's table of sizes, or that of a module beside it that it imports from."""
    for node in tree.body:
        if _assigned(node) == name:
            return {
                key.value: {k.arg: ast.literal_eval(k.value) for k in size.keywords}
                for key, size in zip(node.value.keys, node.value.values, strict=True)
            }
    beside = (n.module for n in tree.body if isinstance(n, ast.ImportFrom) and n.level == 1)
    tables = (_table(folder, _tree(folder / f"{module}.py"), name) for module in beside)
    return next(filter(None, tables), {})


def _assigned(node: ast.stmt) -> str | None:
    return getattr(node.targets[0], "id", None) if isinstance(node, ast.Assign) else None


def _tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))
