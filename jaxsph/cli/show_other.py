"""What files hold that are not HDF5: options, results, pages and pictures."""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

_LONG = 200  # characters of a value that are not shown
_LISTED = 12  # numbers or words of a list that are shown
_MEMBERS = 3  # members of a list of tables that are shown
_TITLE = re.compile(r"<title>(.*?)</title>", re.DOTALL)


def other_contents(path: Path) -> dict[str, str] | None:
    """Names and values of what a file holds, as people read them; None where HDF5 is expected.

    Raises:
        ValueError: if the file is not what its ending says.
    """
    reader = _READERS.get(path.suffix)
    if reader is None:
        return None
    if not path.is_file():
        raise ValueError(f"{path}: no such file; check its name and folder.")
    try:
        return reader(path)
    except (OSError, ValueError, SyntaxError) as error:  # SyntaxError: of a broken picture
        raise ValueError(f"{path}: cannot be read as {path.suffix} ({error}).") from None


def _options(path: Path) -> dict[str, str]:
    """Of a `run.toml`, and the command that it repeats."""
    text = path.read_text(encoding="utf-8")
    rows = {"holds": "options of a command", **dict(_flat(tomllib.loads(text)))}
    found = re.match(r"# (.*) runs this again\n", text)
    if found:
        rows["run again by"] = found[1].replace(path.name, str(path), 1)
    return rows


def _results(path: Path) -> dict[str, str]:
    read = json.loads(path.read_text(encoding="utf-8"))
    table = read if isinstance(read, dict) else {"values": read}
    return {"holds": "results as JSON", **dict(_flat(table))}


def _flat(table: dict[str, Any], above: str = "") -> Iterator[tuple[str, str]]:
    """Rows of a table and of those inside it, named by their way down."""
    for key, value in table.items():
        name = f"{above}.{key}" if above else key
        if isinstance(value, dict):
            yield from _flat(value, name)
        elif isinstance(value, list) and value and all(isinstance(v, dict) for v in value):
            for number, member in enumerate(value[:_MEMBERS]):
                yield from _flat(member, f"{name}.{number}")
            if len(value) > _MEMBERS:
                yield name, f"{len(value)} in all"
        elif isinstance(value, list) and (len(value) > _LISTED or any(map(_nested, value))):
            yield name, f"{len(value)} values"
        else:
            values = value if isinstance(value, list) else [value]
            yield name, " ".join(map(_told, values))[:_LONG]


def _nested(value: Any) -> bool:
    return isinstance(value, (list, dict))


def _told(value: Any) -> str:
    if isinstance(value, float) and math.isfinite(value):
        return f"{value:.6g}"
    return " ".join(str(value).split())


def _page(path: Path) -> dict[str, str]:
    title = _TITLE.search(path.read_text(encoding="utf-8"))
    if title is None:
        raise ValueError("it has no title")
    return {"holds": "a page for a browser", "title": title[1].strip()}


def _picture(path: Path) -> dict[str, str]:
    from PIL import Image  # comes with matplotlib

    with Image.open(path) as image:
        frames = getattr(image, "n_frames", 1)
        rows = {"holds": "a picture", "size": f"{image.width} x {image.height} pixels"}
    return rows | ({"frames": str(frames)} if frames > 1 else {})


def _film(path: Path) -> dict[str, str]:
    with path.open("rb") as file:
        if file.read(12)[4:8] != b"ftyp":
            raise ValueError("it is no MP4")
    return {"holds": "a film"}


_READERS: dict[str, Callable[[Path], dict[str, str]]] = {
    ".toml": _options,
    ".json": _results,
    ".html": _page,
    ".png": _picture,
    ".gif": _picture,
    ".mp4": _film,
}
