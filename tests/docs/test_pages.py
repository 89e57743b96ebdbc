"""What the README and the pages show runs: commands at a small size, Python as it stands."""

import argparse
import re
import runpy
import shlex
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

import jaxsph.cli
import jaxsph_rom.cli
from jaxsph_command.commands import parser
from jaxsph_command.config import typed, write_config

ROOT = Path(__file__).parents[2]
COMMANDS = ROOT / "docs" / "commands.md"
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
MAIN = {"jaxsph": jaxsph.cli.main, "jaxsph-rom": jaxsph_rom.cli.main}
TINY = "--resolution 16 --t-end 0.06 --arrangement lattice"
# what makes a shown command small; a later option replaces an earlier one
SMALLER = {
    ("jaxsph", "run"): TINY,
    ("jaxsph", "sweep"): TINY,
    ("jaxsph-rom", "run"): f"{TINY} --train 100 200 --predict 150 --modes 2",
    ("jaxsph-rom", "train"): f"{TINY} --train 100 200 --modes 2 --closure-iterations 2",
    ("jaxsph-rom", "labels"): "--resolution 16 --time-step 0.025 --modes 3",
}
MAIN_JOB = "jaxsph-rom run taylor-green"  # run by the tests of the release, from the wheel
# the same of a scene in a file that the page shows
SMALLER_OWN = {
    ("jaxsph", "run"): "--resolution 12 --t-end 0.05",
    ("jaxsph-rom", "train"): "--resolution 12 --t-end 0.05 --modes 2",
}
MEANT = {"SCENE": "taylor-green", "FILE": "trajectory.h5", "DIR": "out", "T": "1",
         "my_scene.py:function": "my_scene.py:channel", "name=value": "force=1"}  # fmt: skip


def blocks(page: Path, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", page.read_text(), re.MULTILINE | re.DOTALL)


def is_ours(command: str) -> bool:
    return command.startswith(("jaxsph ", "jaxsph-rom ", "python -m benchmarks."))


def commands(page: Path) -> list[str]:
    """Our commands in the page's blocks, in their order."""
    lines = "".join(blocks(page, "bash")).replace("\\\n", " ").splitlines()
    parts = [part.strip() for line in lines for part in line.split("&&")]
    return [part for part in parts if is_ours(part)]


def mentioned(page: Path) -> list[str]:
    """Our commands in the page's sentences."""
    prose = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.MULTILINE | re.DOTALL)
    found = [" ".join(code.split()) for code in re.findall(r"`([^`]+)`", prose)]
    return [code for code in found if is_ours(code)]


def write_files(page: Path) -> None:
    """Files that the page shows, into the folder that this is in."""
    shown = re.findall(r'^```python title="(.*?)"\n(.*?)^```', page.read_text(), re.M | re.S)
    for name, text in shown:
        Path(name).write_text(text)


def leave_config(page: Path, config: Path) -> None:
    """The `run.toml` of the page's command that writes to its folder, or of any run."""
    writes = [c for c in commands(page) if f"--out {config.parent}" in c]
    words = shlex.split(writes[0] if config.parent.name else "jaxsph run taylor-green")
    program, name, *rest = words
    given = typed(parser(program, words[1:]).chosen, rest)
    write_config(config, SimpleNamespace(typed=given, program=program, name=name))


class Parsed(BaseException):
    """The arguments were good."""


def stop_when_parsed(monkeypatch):
    parse = argparse.ArgumentParser.parse_args

    def parse_args(self, args=None, namespace=None):
        parse(self, args, namespace)
        raise Parsed

    monkeypatch.setattr(argparse.ArgumentParser, "parse_args", parse_args)


SHOWN = [(page, command) for page in PAGES for command in [*commands(page), *mentioned(page)]]


@pytest.mark.parametrize("page, command", SHOWN, ids=[f"{p.stem}: {c}" for p, c in SHOWN])
def test_a_shown_command_has_only_options_that_there_are(
    page, command, monkeypatch, tmp_path, capsys
):
    monkeypatch.chdir(tmp_path)
    write_files(COMMANDS)  # the scene of one's own that other pages name as well
    words = [MEANT.get(word, word) for word in shlex.split(command)]
    if "--config" in words:
        leave_config(page, Path(words[words.index("--config") + 1]))
    stop_when_parsed(monkeypatch)
    monkeypatch.setattr(sys, "argv", words[2:])
    helped = "--help" in words
    with pytest.raises(SystemExit if helped else Parsed) as ended:
        if words[0] in MAIN:
            MAIN[words[0]](words[1:])
        else:
            runpy.run_module(words[2], run_name="__main__", alter_sys=True)
    if helped:  # which ends before it looks at what else is there
        told = capsys.readouterr().out
        assert ended.value.code == 0
        assert all(word in told for word in words[1:] if word.startswith("-"))


def test_the_commands_of_each_page_run_one_after_the_other(tmp_path, monkeypatch):
    """One test for all pages, so that models alike are compiled once."""
    for page in PAGES:
        folder = tmp_path / page.relative_to(ROOT).with_suffix("")
        folder.mkdir(parents=True)
        monkeypatch.chdir(folder)
        write_files(page)
        for command in commands(page):
            words = shlex.split(command)
            if words[0] not in MAIN or command == MAIN_JOB:
                continue  # benchmarks are long; their options are checked above
            sizes = SMALLER_OWN if any(".py" in word for word in words) else SMALLER
            smaller = sizes.get(tuple(words[:2]), "")
            if "--resume" in words:  # it has its size from the file
                smaller = "--from-time 0.02" if "--from-time" in words else ""
            assert MAIN[words[0]]([*words[1:], *smaller.split()]) == 0, f"{page.name}: {command}"


@pytest.mark.parametrize("page", PAGES[1:], ids=lambda page: page.stem)
def test_the_python_of_a_page_runs(page, tmp_path, monkeypatch):
    """The README's has a test of its own."""
    monkeypatch.chdir(tmp_path)
    names = {}
    for block in blocks(page, "python"):
        exec(compile(block, page.name, "exec"), names)
