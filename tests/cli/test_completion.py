"""`jaxsph completion bash`: what a real shell then completes."""

import subprocess
import sys

import pytest

from jaxsph.scenes import SCENES
from jaxsph.schemes import SCHEMES
from jaxsph_command import main
from jaxsph_command.commands import COMMANDS

ASKED = """
source ./script
read -ra COMP_WORDS <<< "$1"
[[ "$1" == *" " ]] && COMP_WORDS+=("")
COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
function=$(complete -p "${COMP_WORDS[0]}" | sed 's/.*-F \\([^ ]*\\) .*/\\1/')
$function "${COMP_WORDS[0]}" "${COMP_WORDS[-1]}" "${COMP_WORDS[-2]}"
printf '%s\\n' "${COMPREPLY[@]}"
"""


@pytest.fixture(scope="module")
def complete(tmp_path_factory):
    """What bash offers for a line, with both programs' scripts."""
    folder = tmp_path_factory.mktemp("completion")
    (folder / "model.h5").write_text("")
    (folder / "runs").mkdir()
    scripts = []
    with pytest.MonkeyPatch.context() as patch:
        for program in COMMANDS:
            patch.setattr("builtins.print", scripts.append)
            assert main(program, ["completion", "bash"]) == 0
    (folder / "script").write_text("\n".join(scripts))

    def ask(line):
        command = ["bash", "--norc", "-c", ASKED, "bash", line]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
        assert done.stderr == ""
        return {word.strip() for word in done.stdout.split()}

    return ask


def test_commands_scenes_options_and_choices(complete):
    assert complete("jaxsph ") >= set(COMMANDS["jaxsph"])
    assert complete("jaxsph an") == {"animate"}
    assert complete("jaxsph-rom pre") == {"predict"}
    assert complete("jaxsph run ") >= set(SCENES)
    assert complete("jaxsph run dam") == {"dam-break", "dam-break-3d"}
    assert complete("jaxsph run dam-break --al") == {"--alpha"}  # a setting of that scene
    assert complete("jaxsph run dam-break --reso") == {"--resolution"}
    assert complete("jaxsph run dam-break --scheme ") == set(SCHEMES)
    assert complete("jaxsph run lid-driven-cavity --lid reg") == {"regularised"}
    assert complete("jaxsph-rom train taylor-green --clos") >= {"--closure", "--closure-iterations"}


def test_files_and_folders(complete):
    assert complete("jaxsph show mo") == {"model.h5"}
    assert complete("jaxsph-rom predict mo") == {"model.h5"}
    assert complete("jaxsph run dam-break --out ru") <= {"runs", "runs/"} != set()


@pytest.mark.parametrize("program", COMMANDS)
def test_zsh_has_a_script(program, capsys):
    assert main(program, ["completion", "zsh"]) == 0
    script = capsys.readouterr().out
    assert all(name in script for name in COMMANDS[program]) and "--resolution" in script


def test_without_shtab_it_says_what_to_install(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "shtab", None)
    assert main("jaxsph", ["completion", "bash"]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "jaxsph[completion]" in error
