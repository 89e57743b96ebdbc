"""One text in one place: a page takes over a section of a file at the repository's root.

A line `@include README.md: In Python` is replaced by what stands under that heading, with the
headings inside one level up; `@include README.md: (start)` by what stands before the first such
heading, and `@include CHANGELOG.md` by all but the title. Links are made those of the page; what
is no page is named where it was linked.
"""

import posixpath
import re
from pathlib import Path

from mkdocs.exceptions import PluginError

ROOT = Path(__file__).parents[2]
_DIRECTIVE = re.compile(r"^@include (?P<file>[\w./]+)(?:: (?P<heading>.+))?$", re.MULTILINE)
_FENCE = re.compile(r"^(```.*?^```)$", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"\[(?P<text>[^\]]*)\]\((?!https?:|#)(?P<target>[^)]+)\)")


def section(text: str, heading: str | None) -> str:
    """All but the title, the part before the first second-level heading, or that under a heading.

    Raises:
        KeyError: if there is no such heading.
    """
    text = re.sub(r"\A# .+\n", "", text)
    if heading is None:
        return text
    if heading == "(start)":
        return re.split(r"^## ", text, flags=re.MULTILINE)[0]
    start = re.search(rf"^(###?) {re.escape(heading)}\n", text, re.MULTILINE)
    if start is None:
        raise KeyError(heading)
    rest = text[start.end() :]
    level = len(start[1])
    return moved_up(re.split(rf"^#{{2,{level}}} ", rest, flags=re.MULTILINE)[0])


def moved_up(text: str) -> str:
    """The text with its headings one level higher; code stays as it is."""
    parts = _FENCE.split(text)
    parts[::2] = [re.sub(r"^##(#+) ", r"#\1 ", part, flags=re.MULTILINE) for part in parts[::2]]
    return "".join(parts)


def on_page_markdown(markdown, page, config, files):
    here = posixpath.dirname(f"docs/{page.file.src_uri}")

    def included(match):
        path, heading = match["file"], match["heading"]
        try:
            found = section((ROOT / path).read_text(encoding="utf-8"), heading)
        except (FileNotFoundError, KeyError) as error:
            raise PluginError(f"{page.file.src_uri}: no '{heading}' in {path}.") from error
        return _LINK.sub(linked, found)

    def linked(link):
        target = link["target"]
        if target.startswith("notebooks/"):  # each has a page, by hooks/notebooks.py
            target = f"docs/{target.removesuffix('.ipynb')}.md"
        if not target.startswith("docs/"):
            return f"`{target}`"
        return f"[{link['text']}]({posixpath.relpath(target, here)})"

    return _DIRECTIVE.sub(included, markdown)
