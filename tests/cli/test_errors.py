"""What commands say of bad input and of what they warn of."""

import argparse
import os
import re
import subprocess
import sys
import warnings
from pathlib import Path

import pytest

import jaxsph
from jaxsph.cli import report_errors
from jaxsph_command.commands import COMMANDS, parser

ENVIRONMENT = {**os.environ, "PYTHONPATH": str(Path(jaxsph.__file__).parents[1])}


def test_a_warning_is_one_line_without_a_place_in_the_code(capsys):
    usual = warnings.formatwarning

    def command():
        print(warnings.formatwarning("more room:\n  again", UserWarning, "file.py", 7), end="")
        return 0

    assert report_errors("jaxsph", command) == 0
    assert capsys.readouterr().out == "jaxsph: warning: more room: again\n"
    assert warnings.formatwarning is usual


def test_bad_input_is_one_line_and_code_2(capsys):
    def command():
        raise ValueError("spacing:\n give more.")

    assert report_errors("jaxsph", command) == 2
    assert capsys.readouterr().err == "jaxsph: error: spacing: give more.\n"


_AT_START = """
import importlib.abc, sys
class Interrupting(importlib.abc.MetaPathFinder):
    def find_spec(self, name, *_):
        if name == "jax":
            raise KeyboardInterrupt
sys.meta_path.insert(0, Interrupting())
"""
_IN_A_COMMAND = """
import importlib
def interrupted(*_):
    raise KeyboardInterrupt
importlib.import_module("jaxsph_command.commands")._command = interrupted
"""


@pytest.mark.parametrize("when", [_AT_START, _IN_A_COMMAND])
@pytest.mark.parametrize("module", ["jaxsph", "jaxsph_rom"])
def test_an_interrupt_is_one_line(module, when):
    command = "show" if module == "jaxsph" else "advise"
    ending = f"import jaxsph_command, sys; sys.argv[1:] = ['{command}', 'x']\n"
    ending += f"sys.exit(jaxsph_command.{module}())"
    script = when.replace("{module}", module) + ending
    done = subprocess.run(
        [sys.executable, "-c", script], env=ENVIRONMENT, capture_output=True, text=True
    )
    assert done.returncode == 130
    program = module.replace("_", "-")
    assert re.fullmatch(f"{program}: error: interrupted.*\n", done.stderr), done.stderr


@pytest.mark.parametrize("at_once", [True, False])
@pytest.mark.parametrize("line", ["jaxsph scenes", "jaxsph run dam-break --help"])
def test_a_reader_that_has_gone_is_no_error(line, at_once):
    """Whether lines are written one by one or all at the end."""
    module, *words = line.split()
    script = (
        f"import sys, jaxsph_command; sys.argv[1:] = {words}\n"
        f"sys.stdout.reconfigure(write_through={at_once})\n"
        f"sys.exit(jaxsph_command.{module}())"
    )
    command = [sys.executable, "-c", script]
    with subprocess.Popen(
        command, env=ENVIRONMENT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        process.stdout.close()
        assert process.stderr.read() == ""
    # as a shell says of a program that SIGPIPE ended; argparse itself passes over it
    assert process.returncode == (0 if at_once and "--help" in words else 141)


@pytest.mark.parametrize("program", COMMANDS)
def test_results_are_asked_for_alike(program):
    """All commands with results take `--json FILE`, and say the same of it."""
    for name, (_, module) in COMMANDS[program].items():
        command = parser(program, [name]).chosen
        (told,) = [a for a in command._actions if a.dest == "json"] or [None]
        if name in ("watch", "completion"):
            assert told is None
            continue
        assert told.help == "write the results to FILE as well" and told.metavar == "FILE", module
        with pytest.raises(argparse.ArgumentTypeError, match="is a folder; name a file"):
            told.type(os.getcwd())
