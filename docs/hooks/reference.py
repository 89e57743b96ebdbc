"""The API reference: a page for each package, with all names that its `__init__` hands on.

A name has its full entry on the page of the innermost package that it is defined in; the packages
around that one link to it. On other pages a line `@computed jaxsph.effects.continuity` is replaced
by the docstrings and the source of what that module defines.
"""

import ast
import re
from functools import cache
from pathlib import Path
from typing import NamedTuple

from mkdocs.structure.files import File

ROOT = Path(__file__).parents[2]
_TOPS = ("jaxsph", "jaxsph_rom")
_ALONE = ("jaxsph.environment", "jaxsph.metrics")  # modules that users import as they are
_COMPUTED = re.compile(r"^@computed (?P<module>[\w.]+)$", re.MULTILINE)
_BARE = (
    "{show_root_heading: false, show_root_toc_entry: false, show_signature: false, "
    "show_bases: false, members: [], merge_init_into_class: false}"
)


class Name(NamedTuple):
    """A public name: as users write it, as it is defined, and its docstring's first paragraph."""

    public: str
    defined: str
    summary: str


def documented() -> list[str]:
    """The packages, and the modules that have a page like one."""
    folders = [init.parent for top in _TOPS for init in ROOT.glob(f"{top}/**/__init__.py")]
    return sorted([*(".".join(folder.relative_to(ROOT).parts) for folder in folders), *_ALONE])


def names(module: str) -> list[Name]:
    """The names that a package hands on, subpackages apart, or that a module defines."""
    found = []
    for node in _tree(module).body:
        if isinstance(node, ast.ImportFrom):
            handed_on = [a.name for a in node.names if a.asname == a.name and node.module]
        else:
            handed_on = [name for name in _defined_by(node) if not name.startswith("_")]
        found += [Name(f"{module}.{name}", *_definition(module, name)) for name in handed_on]
    return found


def _path(module: str) -> Path:
    folder = ROOT.joinpath(*module.split("."))
    return folder / "__init__.py" if folder.is_dir() else folder.with_suffix(".py")


@cache
def _tree(module: str) -> ast.Module:
    return ast.parse(_path(module).read_text(encoding="utf-8"))


def _origin(module: str, node: ast.ImportFrom) -> str:
    """The module that an import names."""
    if not node.level:
        return node.module
    up = node.level - (_path(module).name == "__init__.py")
    parts = module.split(".")
    return ".".join([*parts[: len(parts) - up], node.module])


def _defined_by(node: ast.stmt) -> list[str]:
    if isinstance(node, ast.FunctionDef | ast.ClassDef):
        return [node.name]
    if isinstance(node, ast.Assign):
        return [target.id for target in node.targets if isinstance(target, ast.Name)]
    return []


def _definition(module: str, name: str) -> tuple[str, str]:
    """Where a name is defined, and its docstring's first paragraph."""
    for node in _tree(module).body:
        if name in _defined_by(node):
            text = "" if isinstance(node, ast.Assign) else ast.get_docstring(node) or ""
            return f"{module}.{name}", " ".join(text.partition("\n\n")[0].rstrip(":").split())
        if isinstance(node, ast.ImportFrom) and any(a.name == name for a in node.names):
            return _definition(_origin(module, node), name)
    raise LookupError(f"{module}: {name} is defined nowhere.")


def page(module: str) -> str:
    """The Markdown of a package's page."""
    within = [other for other in documented() if other.startswith(f"{module}.")]
    entries, links = [], []
    for name in names(module):
        if any(name.defined.startswith(f"{other}.") for other in within):
            links.append(f"- [`{name.public}`][{name.defined}]: {name.summary}")
        else:
            label = name.public.rpartition(".")[2]
            options = f"{{heading: {name.public}, toc_label: {label}}}"
            entries.append(f"::: {name.defined}\n    options: {options}\n")
    parts = [f"# {module}", ast.get_docstring(_tree(module)) or ""]
    if within:
        parts.append("Inside: " + ", ".join(f"[{other}]({other}.md)" for other in within) + ".")
    if links:
        parts.append("Handed on from there:\n\n" + "\n".join(links))
    return "\n\n".join([*parts, *entries])


def computed(module: str) -> str:
    """A box to unfold: the docstrings and the source of what a module defines."""
    entries = [
        f"    **{name.public.rpartition('.')[2]}**\n\n"
        f"    ::: {name.defined}\n        options: {_BARE}\n"
        for name in names(module)
    ]
    path = _path(module).relative_to(ROOT).as_posix()
    return "\n".join([f'??? abstract "As computed: {path}"\n', *entries])


def on_config(config):
    pages = [{module: f"reference/{module}.md"} for module in documented()]
    config.nav.append({"API reference": pages})
    return config


def on_files(files, config):
    for module in documented():
        path = f"reference/{module}.md"
        files.append(File.generated(config, path, content=page(module)))
    return files


def on_page_markdown(markdown, page, config, files):
    return _COMPUTED.sub(lambda found: computed(found["module"]), markdown)
