"""What a folder of results holds, and how to look at it."""

from __future__ import annotations

from pathlib import Path

from ..io import read_overview
from ..io.trajectory_file import FORMAT
from .options import bytes_in, bytes_told
from .show_contents import file_format
from .show_other import other_contents

_LISTED = 40  # files and folders
# formats of HDF5 files: what it is, and the command that looks at it
_OF_FORMAT = {
    "jaxsph sweep": ("runs of a sweep", "jaxsph show {}"),
    "jaxsph reduced flow": ("a reduced model", "jaxsph-rom predict {}"),
    "jaxsph reduced labels": ("a reduced model on labels", "jaxsph-rom predict {}"),
    "jaxsph prediction": ("coordinates of reduced runs", "jaxsph show {}"),
    "VTKHDF": ("a run for ParaView", "open {} in ParaView"),
}
_OF_ENDING = {
    ".html": ("a page for a browser", "open {} in a browser"),
    ".json": ("results as JSON", "jaxsph show {}"),
    ".png": ("a picture", "open {}"),
    ".pdf": ("a picture", "open {}"),
    ".svg": ("a picture", "open {}"),
    ".gif": ("a moving picture", "open {}"),
    ".mp4": ("a film", "open {}"),
}


def folder_contents(folder: Path) -> dict[str, str]:
    """A row for each file and folder: what it is, its size, and how to look at it.

    Raises:
        ValueError: if there is nothing in it.
    """
    inside = sorted(path for path in folder.iterdir() if not path.name.startswith("."))
    if not inside:
        raise ValueError(f"{folder}: an empty folder; give one that a command has written to.")
    inside.sort(key=Path.is_dir)  # files first
    rows = {path.name + "/" * path.is_dir(): _told(path) for path in inside[:_LISTED]}
    if len(inside) > _LISTED:
        rows["and"] = f"{len(inside) - _LISTED} more"
    return rows


def _told(path: Path) -> str:
    if path.is_dir():
        count = sum(found.is_file() for found in path.rglob("*"))
        files = f"{count} file{'s' * (count != 1)}, {bytes_told(bytes_in(path))}"
        return f"{files}: jaxsph show {path}"
    size = bytes_told(path.stat().st_size)
    kind, look = _kind(path)
    return f"{kind}, {size}" + (f": {look.format(path)}" if look else "")


def _kind(path: Path) -> tuple[str, str]:
    if path.suffix == ".toml":
        return "options of a command", _again(path)
    if path.suffix in _OF_ENDING:
        return _OF_ENDING[path.suffix]
    found = file_format(path)
    if found == FORMAT:
        return _run(path), "jaxsph animate {}"
    return _OF_FORMAT.get(found or "", ("not a file of this project", ""))


def _again(path: Path) -> str:
    """The command that repeats what left a `run.toml`."""
    try:
        return (other_contents(path) or {}).get("run again by", "jaxsph show {}")
    except ValueError:
        return ""


def _run(path: Path) -> str:
    try:
        overview = read_overview(path)
    except (OSError, ValueError) as error:
        return f"a run that cannot be read ({error})"
    whole = "complete" if overview.complete else "not complete"
    return f"a run of {overview.scene}, {overview.snapshots} snapshots, {whole}"
