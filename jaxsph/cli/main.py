"""The `jaxsph` command and its subcommands."""

from __future__ import annotations

from ..version import __version__
from . import animate, export, run, scenes, show, sweep
from .errors import Parser, report_errors


def main(argv: list[str] | None = None) -> int:
    """The `jaxsph` command. Exit code 0: good, 1: a fault in mid-run, 2: bad input."""
    return report_errors("jaxsph", _command, argv)


def _command(argv) -> int:
    options = _parser().parse_args(argv)
    return options.command(options)


def _parser() -> Parser:
    parser = Parser("jaxsph", description="Differentiable smoothed-particle hydrodynamics.")
    parser.add_argument("--version", action="version", version=f"jaxsph {__version__}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    for command in (scenes, run, sweep, show, export, animate):
        command.add_to(commands)
    return parser
