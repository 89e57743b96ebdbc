"""A line `@help jaxsph` is replaced by what each command of that program says of itself."""

import argparse
import importlib
import os
import re
from unittest import mock

_DIRECTIVE = re.compile(r"^@help (?P<program>jaxsph(?:-rom)?)$", re.MULTILINE)


class _Made(BaseException):
    """Takes the parser out of the program that has made it."""


def _parser(program: str) -> argparse.ArgumentParser:
    def parse_args(self, *_):
        raise _Made(self)

    main = importlib.import_module(program.replace("-", "_") + ".cli").main
    with mock.patch.object(argparse.ArgumentParser, "parse_args", parse_args):
        try:
            main([])
        except _Made as made:
            return made.args[0]
    raise RuntimeError(f"{program}: does not parse its arguments by argparse.")


def sections(program: str) -> str:
    """A heading and the help of each command."""
    actions = _parser(program)._actions
    (commands,) = (a.choices for a in actions if isinstance(a, argparse._SubParsersAction))
    with mock.patch.dict(os.environ, {"COLUMNS": "80", "NO_COLOR": "1"}):
        texts = {name: parser.format_help() for name, parser in commands.items()}
    return "\n".join(
        f"### {program} {name}\n\n```text\n{text}```\n" for name, text in texts.items()
    )


def on_page_markdown(markdown, page, config, files):
    return _DIRECTIVE.sub(lambda found: sections(found["program"]), markdown)
