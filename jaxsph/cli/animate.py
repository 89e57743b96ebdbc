"""`jaxsph animate FILE.h5`: a run as a moving picture."""

from __future__ import annotations

from pathlib import Path

from jaxsph_command.errors import Parser

from ..io import read_overview
from ..progress import progress_bar
from .options import add_json_option, positive_int, print_rows, write_json

FRAMES = 100  # at most, unless more are asked for
FIELDS = ("velocity", "pressure", "density", "vorticity")


def add_to(parser: Parser, words: list[str]) -> None:
    """Add the command's options to its parser."""
    parser.description = (
        "Draw the particles of a trajectory file at all its times, coloured by a "
        "field; of three-dimensional ones the middle layer."
    )
    parser.set_defaults(command=_animate)
    add = parser.add_argument
    add("file", type=Path, metavar="FILE", help="trajectory.h5 of a run; it may still be written")
    add_json_option(parser)
    add("--out", type=Path, metavar="DIR",
        help="folder of it, or a file ending with .gif or .mp4 (default: FILE's)")  # fmt: skip
    add("--field", choices=FIELDS, default="velocity", help="default: %(default)s")
    add("--every", type=positive_int, metavar="N",
        help=f"show every N-th snapshot (default: for {FRAMES} frames or fewer)")  # fmt: skip
    add("--fps", type=positive_int, default=15, metavar="N",
        help="frames per second (default: %(default)s)")  # fmt: skip


def _animate(options) -> int:
    from .. import plotting  # matplotlib takes its time to load

    path = options.out or options.file.parent
    ending = path.suffix[1:]
    if path.is_dir() or not (ending.isalpha() or ending == "mp4"):  # a folder, run_0.5 say
        path = path / f"{options.file.stem}.gif"
    overview = read_overview(options.file)
    every = options.every or max(1, -(-overview.snapshots // FRAMES))
    count = -(-overview.snapshots // every)
    field = plotting.FIELDS[options.field]
    with progress_bar(count, "frame") as bar:
        plotting.animate(options.file, path, field, every, options.fps, bar.update)
    rows = {
        "frames": f"{count} of {overview.snapshots} snapshots, {options.fps} per second",
        "field": field.label.replace("$", ""),
        "written": str(path),
    }
    print_rows(rows)
    write_json(options.json, rows)
    return 0
