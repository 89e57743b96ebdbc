"""`jaxsph export FILE.h5`: a run for ParaView."""

from __future__ import annotations

from pathlib import Path

from ..io import read_overview, write_vtkhdf
from ..io.vtkhdf import EXPORTED
from ..progress import progress_bar
from .options import positive_int, print_rows


def add_to(commands) -> None:
    """Add the command to a parser's commands."""
    export = commands.add_parser(
        "export",
        help="write a run for ParaView",
        description="Write a trajectory file as VTKHDF, which ParaView (5.12 and later) opens with "
        "all its times. Units are SI: m, s, m/s, kg/m^3, Pa. In two dimensions z is 0.",
    )
    export.set_defaults(command=_export)
    add = export.add_argument
    add("file", type=Path, metavar="FILE", help="trajectory.h5 of a run; it may still be written")
    add("--out", type=Path, metavar="FILE", help="to write (default: FILE, ending with .vtkhdf)")
    add("--fields", nargs="+", choices=EXPORTED, default=EXPORTED, metavar="FIELD",
        help=f"of {', '.join(EXPORTED)} (default: all)")  # fmt: skip
    add("--every", type=positive_int, default=1, metavar="N",
        help="write every N-th snapshot (default: %(default)s)")  # fmt: skip


def _export(options) -> int:
    path = options.file.with_suffix(".vtkhdf") if options.out is None else options.out
    overview = read_overview(options.file)
    count = -(-overview.snapshots // options.every)
    with progress_bar(count, "snapshot") as bar:
        write_vtkhdf(options.file, path, options.fields, options.every, bar.update)
    print_rows({
        "snapshots": f"{count} of {overview.snapshots}",
        "fields": f"position, {', '.join(options.fields)}",
        "written": str(path),
    })  # fmt: skip
    return 0
