"""The `jaxsph-rom` command and its subcommands."""

from __future__ import annotations

from jaxsph import __version__
from jaxsph.cli import Parser, report_errors

from . import advise, predict, run, suggest, train


def main(argv: list[str] | None = None) -> int:
    """The `jaxsph-rom` command. Exit code 0: good, 1: a full run failed, 2: bad input."""
    return report_errors("jaxsph-rom", _command, argv)


def _command(argv) -> int:
    options = _parser().parse_args(argv)
    return options.command(options)


def _parser() -> Parser:
    parser = Parser("jaxsph-rom", description="Projection-based reduced models of SPH flows.")
    parser.add_argument("--version", action="version", version=f"jaxsph-rom {__version__}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    for command in (run, train, predict, suggest, advise):
        command.add_to(commands)
    return parser
