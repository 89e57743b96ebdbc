"""What is wrong with a command's input, as one line on stderr and an exit code."""

from __future__ import annotations

import argparse
import difflib
import os
import sys
import warnings
from collections.abc import Iterable
from typing import NoReturn


class Parser(argparse.ArgumentParser):
    """An argument parser whose errors are `ValueError`s, for `report_errors` to print."""

    chosen: Parser | None = None  # of the command that is named
    subject = "the command"  # what has options, in the error for those that it has not

    def __init__(self, *arguments, **options):
        super().__init__(*arguments, allow_abbrev=False, **options)

    def error(self, message: str) -> NoReturn:
        parser = self.chosen or self
        unknown = message.partition("unrecognized arguments: ")[2].split()
        if unknown:
            flag = unknown[0].partition("=")[0]
            near = meant(flag, parser._option_string_actions)
            kind = "option" if flag.startswith("-") else "word"
            message = f"{flag}: {parser.subject} has no such {kind}{near}"
        raise ValueError(f"{message} (see {parser.prog} --help).")

    def _check_value(self, action, value):
        if action.choices is not None and value not in action.choices:
            text = f"invalid choice: {value!r}{meant(str(value), action.choices)}, choose from "
            raise argparse.ArgumentError(action, text + ", ".join(map(repr, action.choices)))


def meant(name: str, known: Iterable[str]) -> str:
    """` (did you mean X?)` where something known is near."""
    near = difflib.get_close_matches(name, list(known), n=1)
    return f" (did you mean {near[0]}?)" if near else ""


def report_errors(program: str, command, *arguments) -> int:
    """Run a command; what is wrong with its input becomes one line on stderr and code 2.

    A disk that fails in mid-run gives code 1, an interrupt 130, and a reader of the output that has
    gone, as `head` does, ends the command without a word. Warnings are a line each, without the
    place in the code that users of a command did not write.
    """
    usual = warnings.formatwarning
    warnings.formatwarning = lambda message, *_, **__: f"{program}: warning: {_line(message)}\n"
    try:
        return _flushed(command, *arguments)
    except KeyboardInterrupt:
        return fail(program, "interrupted; what is kept goes on by the same command.", 130)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # for the last flush
        return 141  # as a shell says of a program that SIGPIPE ended
    except MemoryError:
        return fail(program, "not enough memory; lower the resolution.", 2)
    except ValueError as error:
        return fail(program, str(error), 2)
    except OSError as error:
        return fail(program, f"{error}; choose another place.", 1)
    finally:
        warnings.formatwarning = usual


def _flushed(command, *arguments) -> int:
    """The command's exit code, all that it printed being out."""
    try:
        code = command(*arguments)
    except SystemExit:  # as --help ends
        sys.stdout.flush()
        raise
    sys.stdout.flush()
    return code


def fail(program: str, message: str, code: int) -> int:
    """Print an error as one line on stderr; the exit code is handed back."""
    print(f"{program}: error: {_line(message)}", file=sys.stderr)
    return code


def _line(text) -> str:
    return " ".join(str(text).split())
