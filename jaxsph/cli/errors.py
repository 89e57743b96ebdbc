"""What is wrong with a command's input, as one line on stderr and an exit code."""

from __future__ import annotations

import argparse
import os
import sys
import warnings
from typing import NoReturn


class Parser(argparse.ArgumentParser):
    """An argument parser whose errors are `ValueError`s, for `report_errors` to print."""

    def error(self, message: str) -> NoReturn:
        raise ValueError(f"{message} (see {self.prog} --help).")


def report_errors(program: str, command, *arguments) -> int:
    """Run a command; what is wrong with its input becomes one line on stderr and code 2.

    A disk that fails in mid-run gives code 1, an interrupt 130, and a reader of the output that has
    gone, as `head` does, ends the command without a word. Warnings are a line each, without the
    place in the code that users of a command did not write.
    """
    usual = warnings.formatwarning
    warnings.formatwarning = lambda message, *_, **__: f"{program}: warning: {_line(message)}\n"
    try:
        code = command(*arguments)
        sys.stdout.flush()
        return code
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


def fail(program: str, message: str, code: int) -> int:
    """Print an error as one line on stderr; the exit code is handed back."""
    print(f"{program}: error: {_line(message)}", file=sys.stderr)
    return code


def _line(text) -> str:
    return " ".join(str(text).split())
