"""What the README and the pages show runs: commands at a small size, Python as it stands."""

import argparse
import re
import runpy
import shlex
import sys
from pathlib import Path

import pytest

import jaxsph.cli
import jaxsph_rom.cli

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
MAIN = {"jaxsph": jaxsph.cli.main, "jaxsph-rom": jaxsph_rom.cli.main}
TINY = "--resolution 16 --t-end 0.06 --arrangement lattice"
# what makes a shown command small; a later option replaces an earlier one
SMALLER = {
    ("jaxsph", "run"): TINY,
    ("jaxsph", "sweep"): TINY,
    ("jaxsph-rom", "run"): f"{TINY} --train 100 200 --predict 150 --modes 2",
    ("jaxsph-rom", "train"): f"{TINY} --train 100 200 --modes 2 --closure-iterations 2",
}
MEANT = {"SCENE": "taylor-green", "FILE": "trajectory.h5", "DIR": "out"}


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


class Parsed(BaseException):
    """The arguments were good."""


@pytest.fixture
def stop_when_parsed(monkeypatch):
    parse = argparse.ArgumentParser.parse_args

    def parse_args(self, args=None, namespace=None):
        parse(self, args, namespace)
        raise Parsed

    monkeypatch.setattr(argparse.ArgumentParser, "parse_args", parse_args)


SHOWN = [(page, command) for page in PAGES for command in [*commands(page), *mentioned(page)]]


@pytest.mark.parametrize("page, command", SHOWN, ids=[f"{p.stem}: {c}" for p, c in SHOWN])
def test_a_shown_command_has_only_options_that_there_are(
    page, command, stop_when_parsed, monkeypatch, tmp_path
):
    monkeypatch.chdir(tmp_path)  # with the file of one's own that some commands name
    Path("my_scene.py").write_text("def function(name): ...\ndef channel(force): ...\n")
    words = [MEANT.get(word, word) for word in shlex.split(command)]
    monkeypatch.setattr(sys, "argv", words[2:])
    with pytest.raises(Parsed):
        if words[0] in MAIN:
            MAIN[words[0]](words[1:])
        else:
            runpy.run_module(words[2], run_name="__main__", alter_sys=True)


def test_the_commands_of_each_page_run_one_after_the_other(tmp_path, monkeypatch):
    """One test for all pages, so that models alike are compiled once."""
    for page in PAGES:
        folder = tmp_path / page.relative_to(ROOT).with_suffix("")
        folder.mkdir(parents=True)
        monkeypatch.chdir(folder)
        for command in commands(page):
            words = shlex.split(command)
            if words[0] not in MAIN:
                continue  # benchmarks are long; their options are checked above
            smaller = SMALLER.get(tuple(words[:2]), "")
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
