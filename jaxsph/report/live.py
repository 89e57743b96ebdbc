"""A page that follows a file as it is written, served on this machine alone."""

from __future__ import annotations

from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import final

from ..io import read_box, read_overview, read_snapshot, read_walls_of
from ..plotting import FIELDS, ParticleField, snapshot_figure
from ..plotting.style import png
from . import page

HOST = "127.0.0.1"  # nothing outside this machine reaches it
_WAITING = "There is nothing to draw yet."


@final
class LivePage:
    """What is told of a run at the moment.

    Args:
        source: the trajectory file.
        rows: names and values that are told of it, anew at each call.
        seconds: after which a browser asks again, until the run is complete.
        fields: that are drawn of the last snapshot.
    """

    def __init__(
        self,
        source: Path,
        rows: Callable[[], dict[str, str]],
        seconds: float = 2.0,
        fields: tuple[ParticleField, ...] = (FIELDS["velocity"], FIELDS["pressure"]),
    ):
        self.source, self.rows, self.seconds, self.fields = source, rows, seconds, fields
        self._drawn: tuple[int, str] = 0, page.paragraph(_WAITING)

    def text(self) -> str:
        """The page."""
        try:
            complete, pieces = self._pieces()
        except ValueError as error:  # the file is about to be made, or was taken away
            complete, pieces = False, [page.paragraph(str(error))]
        again = None if complete else self.seconds
        return page.page_text(f"jaxsph: {self.source.name}", pieces, again)

    def _pieces(self) -> tuple[bool, list[str]]:
        overview = read_overview(self.source)
        count = overview.snapshots
        if count != self._drawn[0]:  # drawing takes its time
            time, snapshot = read_snapshot(self.source, count - 1)
            drawn = snapshot_figure(
                time,
                snapshot,
                self.fields,
                read_walls_of(self.source, snapshot),
                read_box(self.source),
            )
            self._drawn = count, page.figure(png(drawn), f"Snapshot {count}, t = {time:g} s.")
        return overview.complete, [self._drawn[1], page.rows(self.rows())]


def server(live: LivePage, port: int = 0) -> HTTPServer:
    """A server of the page at `HOST`; `serve_forever` of it serves.

    Args:
        live: the page.
        port: 0 for any that is free.

    Raises:
        OSError: if the port is taken.
    """

    class Answer(BaseHTTPRequestHandler):
        def do_GET(self):
            found = self.path == "/"
            body = (live.text() if found else "There is one page here: /").encode()
            self.send_response(200 if found else 404)
            self.send_header("Content-Type", "text/html; charset=utf-8")
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *_):
            """Nothing is printed of each call."""

    return HTTPServer((HOST, port), Answer)
