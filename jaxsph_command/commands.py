"""Both programs' commands; the one that is named is imported, the others are only told of."""

from __future__ import annotations

import argparse
import sys
from importlib import import_module

from .config import add_config_option, expanded, typed
from .errors import Parser, report_errors

_SHOW = ("a quick look at a run, at any other file, or at a folder", "jaxsph.cli.show")
_COMPLETION = ("what lets a shell complete these words", "jaxsph_command.completion")
# command: what it does in a line, and the module that adds its options
COMMANDS = {
    "jaxsph": {
        "scenes": ("list the scenes, or tell what one can be given", "jaxsph_command.scenes"),
        "run": ("run a full model", "jaxsph.cli.run"),
        "sweep": ("run a scene at many Reynolds numbers and seeds", "jaxsph.cli.sweep"),
        "show": _SHOW,
        "watch": ("a page on this machine that follows a running file", "jaxsph.cli.watch"),
        "export": ("write a run for ParaView", "jaxsph.cli.export"),
        "animate": ("draw a run as a moving picture", "jaxsph.cli.animate"),
        "completion": _COMPLETION,
    },
    "jaxsph-rom": {
        "run": ("train, predict, compare with the full model", "jaxsph_rom.cli.run"),
        "train": ("make a reduced model on reference points, as a file", "jaxsph_rom.cli.train"),
        "labels": (
            "make a reduced model of a free surface, on labels, as a file",
            "jaxsph_rom.cli.labels",
        ),
        "predict": (
            "run the file of a reduced model at any parameters",
            "jaxsph_rom.cli.predict",
        ),
        "suggest": (
            "where a reduced model needs its next training run",
            "jaxsph_rom.cli.suggest",
        ),
        "show": _SHOW,
        "advise": ("which setting to use for a wanted accuracy or time", "jaxsph_rom.cli.advise"),
        "completion": _COMPLETION,
    },
}
_ABOUT = {
    "jaxsph": "Differentiable smoothed-particle hydrodynamics.",
    "jaxsph-rom": "Projection-based reduced models of SPH flows.",
}


def main(program: str, argv: list[str] | None = None) -> int:
    """A program. Exit code 0: good, 1: a fault in mid-run, 2: bad input."""
    return report_errors(program, _command, program, argv)


def parser(program: str, words: list[str], every: bool = False) -> Parser:
    """A program's parser, with the options of the command that the words name, or of every one."""
    top = Parser(program, description=_ABOUT[program])
    top.add_argument("--version", action=_Version, nargs=0, help="show the version")
    commands = top.add_subparsers(metavar="COMMAND", required=True)
    for name, (told, module) in COMMANDS[program].items():
        command = commands.add_parser(name, help=told)
        if every or words[:1] == [name]:
            import_module(module).add_to(command, [] if every else words[1:])
            add_config_option(command)
            top.chosen = command
    return top


def _command(program: str, argv: list[str] | None) -> int:
    words = expanded(sys.argv[1:] if argv is None else list(argv))
    options = parser(program, words).parse_args(words)
    options.program, options.name = program, words[0]
    options.typed = typed(parser(program, words).chosen, words[1:])
    return options.command(options)


class _Version(argparse.Action):
    """Looks the version up when it is asked for."""

    def __call__(self, parser, *_):
        print(f"{parser.prog} {import_module('jaxsph.version').__version__}")
        parser.exit()
