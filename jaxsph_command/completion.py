"""`jaxsph completion SHELL`: what lets a shell complete a program's words."""

from __future__ import annotations

import argparse
from importlib import import_module
from pathlib import Path

from .errors import Parser

SHELLS = ("bash", "zsh")


def add_to(parser: Parser, words: list[str]) -> None:
    """Add the command's options to its parser."""
    parser.description = (
        "Print a script by which a shell completes commands, options, their choices, scenes and "
        f'files: eval "$({parser.prog} bash)" in ~/.bashrc. It needs jaxsph[completion].'
    )
    parser.set_defaults(command=_complete)
    parser.add_argument("shell", choices=SHELLS, metavar="SHELL", help=f"{' or '.join(SHELLS)}")


def _complete(options) -> int:
    try:
        import shtab
    except ImportError:
        raise ValueError(
            'completion: shtab is not here; python -m pip install "jaxsph[completion]".'
        ) from None
    print(shtab.complete(_whole(options.program, shtab), options.shell))
    return 0


def _whole(program: str, shtab) -> Parser:
    """A program's parser with every command, and the settings of every scene."""
    from .commands import COMMANDS, parser
    from .scenes import scenes

    names = [name for name, *_ in scenes()]
    whole = parser(program, [], every=True)
    (commands,) = (a for a in whole._actions if isinstance(a, argparse._SubParsersAction))
    for name, command in commands.choices.items():
        if name != "scenes" and any(action.dest == "scene" for action in command._actions):
            _add_settings(command, COMMANDS[program][name][1], names)
        for action in command._actions:
            if action.dest == "scene":
                action.choices = names
            elif action.metavar == "DIR":
                action.complete = shtab.DIRECTORY
            elif action.type is Path or action.metavar == "FILE":
                action.complete = shtab.FILE
    return whole


def _add_settings(command: Parser, module: str, names: list[str]) -> None:
    """Options that only some scenes have."""
    for scene in names:
        own = Parser()
        import_module(module).add_to(own, [scene])
        for action in own._actions:
            flag = (action.option_strings or [None])[-1]
            if flag is not None and flag not in command._option_string_actions:
                command.add_argument(flag, help=action.help, choices=action.choices)
