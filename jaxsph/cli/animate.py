"""`jaxsph animate FILE.h5`: a run as a moving picture."""

from __future__ import annotations

from pathlib import Path

from ..io import read_overview
from ..progress import progress_bar
from .options import positive_int, print_rows

FRAMES = 100  # at most, unless more are asked for
FIELDS = ("velocity", "pressure", "density")


def add_to(commands) -> None:
    """Add the command to a parser's commands."""
    animate = commands.add_parser(
        "animate",
        help="draw a run as a moving picture",
        description="Draw the particles of a trajectory file at all its times, coloured by a "
        "field; of three-dimensional ones the middle layer.",
    )
    animate.set_defaults(command=_animate)
    add = animate.add_argument
    add("file", type=Path, metavar="FILE", help="trajectory.h5 of a run; it may still be written")
    add("--out", type=Path, metavar="FILE",
        help=".gif or .mp4 to write (default: FILE, ending with .gif)")  # fmt: skip
    add("--field", choices=FIELDS, default="velocity", help="default: %(default)s")
    add("--every", type=positive_int, metavar="N",
        help=f"show every N-th snapshot (default: for {FRAMES} frames or fewer)")  # fmt: skip
    add("--fps", type=positive_int, default=15, metavar="N",
        help="frames per second (default: %(default)s)")  # fmt: skip


def _animate(options) -> int:
    from .. import plotting  # matplotlib takes its time to load

    path = options.file.with_suffix(".gif") if options.out is None else options.out
    overview = read_overview(options.file)
    every = options.every or max(1, -(-overview.snapshots // FRAMES))
    count = -(-overview.snapshots // every)
    field = plotting.FIELDS[options.field]
    with progress_bar(count, "frame") as bar:
        plotting.animate(options.file, path, field, every, options.fps, bar.update)
    print_rows({
        "frames": f"{count} of {overview.snapshots} snapshots, {options.fps} per second",
        "field": field.label.replace("$", ""),
        "written": str(path),
    })  # fmt: skip
    return 0
