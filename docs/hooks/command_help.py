"""A line `@help jaxsph run` is replaced by what `jaxsph run --help` prints."""

import contextlib
import importlib
import io
import os
import re
from unittest import mock

_DIRECTIVE = re.compile(r"^@help (?P<line>jaxsph.*)$", re.MULTILINE)
_MAIN = {"jaxsph": "jaxsph.cli", "jaxsph-rom": "jaxsph_rom.cli"}


def printed(line: str) -> str:
    """The help of a command."""
    program, *rest = line.split()
    main = importlib.import_module(_MAIN[program]).main
    with (
        contextlib.redirect_stdout(io.StringIO()) as out,
        contextlib.suppress(SystemExit),
        mock.patch.dict(os.environ, {"COLUMNS": "88", "NO_COLOR": "1"}),
    ):
        main([*rest, "--help"])
    return out.getvalue()


def on_page_markdown(markdown, page, config, files):
    return _DIRECTIVE.sub(lambda m: f"```text\n{printed(m['line'])}```", markdown)
