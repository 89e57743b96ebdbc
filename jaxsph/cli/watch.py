"""`jaxsph watch FILE`: a page on this machine that follows a running file."""

from __future__ import annotations

import argparse
from pathlib import Path

from jaxsph_command.errors import Parser

from ..io import read_overview
from .animate import FIELDS
from .options import positive_float
from .show import measures_of, rows_of

_PORTS = 65535


def add_to(parser: Parser, words: list[str]) -> None:
    """Add the command's options to its parser."""
    parser.description = (
        "Serve a page that follows a trajectory file as it is written: the last snapshot, how far "
        "the run has come and what its particles do. Only this machine reaches it; Ctrl-C ends it."
    )
    parser.set_defaults(command=_watch)
    add = parser.add_argument
    add("file", type=Path, metavar="FILE", help="trajectory.h5 of a run")
    add("--port", type=_port, default=0, metavar="N", help="(default: one that is free)")
    add("--seconds", type=positive_float, default=2.0, metavar="S",
        help="after which the page looks again (default: %(default)s)")  # fmt: skip
    add("--fields", choices=FIELDS, nargs="+", default=("velocity", "pressure"), metavar="NAME",
        help=f"to draw, of {', '.join(FIELDS)} (default: velocity pressure)")  # fmt: skip


def _watch(options) -> int:
    from .. import plotting  # matplotlib takes its time to load
    from ..report.live import HOST, LivePage, server

    def rows() -> dict[str, str]:
        overview = read_overview(options.file)
        return rows_of(overview, measures_of(options.file, overview))

    rows()  # a file that is none is refused here
    fields = tuple(plotting.FIELDS[name] for name in dict.fromkeys(options.fields))
    live = LivePage(options.file, rows, options.seconds, fields)
    try:
        with server(live, options.port) as serving:
            print(f"http://{HOST}:{serving.server_port}/ follows {options.file}; Ctrl-C ends it",
                  flush=True)  # fmt: skip
            serving.serve_forever()
    except OSError as error:
        raise ValueError(f"--port: {options.port} cannot be had ({error.strerror}).") from None
    except KeyboardInterrupt:
        return 0
    return 0


def _port(text: str) -> int:
    """A number of a port; 0 for any."""
    value = int(text)
    if not 0 <= value <= _PORTS:
        raise argparse.ArgumentTypeError(f"must be from 0 to {_PORTS}, got {text}")
    return value
