"""A line `@help jaxsph` is replaced by what each command of that program says of itself."""

import argparse
import os
import re
from unittest import mock

from jaxsph_command.commands import parser

_DIRECTIVE = re.compile(r"^@help (?P<program>jaxsph(?:-rom)?)$", re.MULTILINE)


def sections(program: str) -> str:
    """A heading and the help of each command."""
    actions = parser(program, [], every=True)._actions
    (commands,) = (a.choices for a in actions if isinstance(a, argparse._SubParsersAction))
    with mock.patch.dict(os.environ, {"COLUMNS": "80", "NO_COLOR": "1"}):
        texts = {name: command.format_help() for name, command in commands.items()}
    return "\n".join(
        f"### {program} {name}\n\n```text\n{text}```\n" for name, text in texts.items()
    )


def on_page_markdown(markdown, page, config, files):
    return _DIRECTIVE.sub(lambda found: sections(found["program"]), markdown)
