"""What commands say of bad input and of what they warn of."""

import os
import re
import subprocess
import sys
import warnings
from pathlib import Path

import pytest

import jaxsph
from jaxsph.cli import report_errors

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


def test_a_reader_that_has_gone_is_no_error():
    script = (
        "import sys; from jaxsph.cli import main\n"
        "sys.stdout.reconfigure(write_through=True); sys.exit(main(['scenes']))"
    )
    command = [sys.executable, "-c", script]
    with subprocess.Popen(
        command, env=ENVIRONMENT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        process.stdout.close()
        assert process.stderr.read() == ""
    assert process.returncode == 141
