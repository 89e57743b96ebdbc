"""One HTML file with all it shows inside: figures as data, styles and scripts inline, no network.

Each function turns plain text and numbers into a piece of HTML, escaped; `write_page` puts pieces
together.
"""

from __future__ import annotations

import base64
import os
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path

_STYLE = """
:root { color-scheme: light dark; }
body { font: 15px/1.5 system-ui, sans-serif; color: #1a1a1a; background: #fff;
       max-width: 68rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.6rem; } h2 { font-size: 1.15rem; margin-top: 2rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { text-align: left; vertical-align: top; padding: 0.2rem 0.9rem 0.2rem 0;
         border-bottom: 1px solid #d9d9d9; }
th { font-weight: 600; } thead th { border-bottom: 2px solid #1a1a1a; vertical-align: bottom; }
.number { text-align: right; } td.number { white-space: nowrap; }
figure { margin: 1rem 0; } img { max-width: 100%; height: auto; }
figcaption { color: #4d4d4d; }
.film canvas { display: block; max-width: 100%; } .film p { margin: 0.2rem 0 0.6rem; }
.film input { width: min(28rem, 60%); vertical-align: middle; margin: 0 0.6rem; }
@media (prefers-color-scheme: dark) {
  body { color: #e6e6e6; background: #16181c; } figcaption { color: #b3b3b3; }
  th, td { border-color: #3a3d44; } thead th { border-color: #e6e6e6; }
}
"""


def heading(text: str) -> str:
    """The title of a part."""
    return f"<h2>{escape(text)}</h2>"


def paragraph(text: str) -> str:
    """A line or more of text."""
    return f"<p>{escape(text)}</p>"


def rows(values: Mapping[str, object]) -> str:
    """Names and values below each other."""
    lines = (
        f'<tr><th scope="row">{escape(str(name))}</th><td>{escape(str(value))}</td></tr>'
        for name, value in values.items()
    )
    return f'<div class="wide"><table><tbody>{"".join(lines)}</tbody></table></div>'


def table(columns: Sequence[str], lines: Iterable[Sequence[str]], numbers: Sequence[bool]) -> str:
    """A table with a head.

    Args:
        columns: their names.
        lines: the cells of each line, one a column.
        numbers: whether a column holds numbers, which stand to the right.
    """
    kinds = [' class="number"' if number else "" for number in numbers]

    def line(tag: str, cells: Sequence[str]) -> str:
        pairs = zip(cells, kinds, strict=True)
        return f"<tr>{''.join(f'<{tag}{kind}>{escape(c)}</{tag}>' for c, kind in pairs)}</tr>"

    body = "".join(line("td", cells) for cells in lines)
    head = line("th", columns)
    return f'<div class="wide"><table><thead>{head}</thead><tbody>{body}</tbody></table></div>'


def figure(png: bytes, caption: str) -> str:
    """A picture, inside the page, and what it shows."""
    data, text = base64.b64encode(png).decode("ascii"), escape(caption)
    return (
        f'<figure><img alt="{text}" src="data:image/png;base64,{data}">'
        f"<figcaption>{text}</figcaption></figure>"
    )


def page_text(title: str, pieces: Iterable[str], again: float | None = None) -> str:
    """A page; one that is to be loaded again after some seconds if `again` is given."""
    name = escape(title)
    refresh = "" if again is None else f'<meta http-equiv="refresh" content="{again:g}">\n'
    head = (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n{refresh}'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{name}</title>\n<style>{_STYLE}</style>\n</head>\n<body>\n<h1>{name}</h1>\n"
    )
    return head + "\n".join(pieces) + "\n</body>\n</html>\n"


def write_page(path: str | os.PathLike, title: str, pieces: Iterable[str]) -> Path:
    """Write a page, whole or not at all, and return its path.

    Args:
        path: of the file; folders are made as needed.
        title: of the page.
        pieces: made by the other functions here.
    """
    path, text = Path(path), page_text(title, pieces)
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        unfinished.write_text(text, encoding="utf-8")
        os.replace(unfinished, path)
    finally:
        unfinished.unlink(missing_ok=True)
    return path
