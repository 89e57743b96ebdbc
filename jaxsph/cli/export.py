"""`jaxsph export FILE.h5`: a run for ParaView."""

from __future__ import annotations

from pathlib import Path

from jaxsph_command.errors import Parser

from ..io import read_overview, write_vtkhdf
from ..io.vtkhdf import EXPORTED
from ..progress import progress_bar
from .options import add_json_option, positive_int, print_rows, result_file, write_json


def add_to(parser: Parser, words: list[str]) -> None:
    """Add the command's options to its parser."""
    parser.description = (
        "Write a trajectory file as VTKHDF, which ParaView (5.12 and later) opens with "
        "all its times. Units are SI: m, s, m/s, kg/m^3, Pa. In two dimensions z is 0."
    )
    parser.set_defaults(command=_export)
    add = parser.add_argument
    add("file", type=Path, metavar="FILE", help="trajectory.h5 of a run; it may still be written")
    add("--out", type=Path, metavar="DIR",
        help="folder of it, or a file ending with .vtkhdf (default: that of FILE)")  # fmt: skip
    add_json_option(parser)
    add("--fields", nargs="+", choices=EXPORTED, default=EXPORTED, metavar="FIELD",
        help=f"of {', '.join(EXPORTED)} (default: all)")  # fmt: skip
    add("--every", type=positive_int, default=1, metavar="N",
        help="write every N-th snapshot (default: %(default)s)")  # fmt: skip


def _export(options) -> int:
    path = result_file(options.out, options.file.parent, f"{options.file.stem}.vtkhdf")
    overview = read_overview(options.file)
    count = -(-overview.snapshots // options.every)
    with progress_bar(count, "snapshot") as bar:
        write_vtkhdf(options.file, path, options.fields, options.every, bar.update)
    rows = {
        "snapshots": f"{count} of {overview.snapshots}",
        "fields": f"position, {', '.join(options.fields)}",
        "written": str(path),
    }
    print_rows(rows)
    write_json(options.json, rows)
    return 0
