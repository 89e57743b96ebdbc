"""The `jaxsph` command."""

from __future__ import annotations

import jaxsph_command


def main(argv: list[str] | None = None) -> int:
    """The `jaxsph` command. Exit code 0: good, 1: a fault in mid-run, 2: bad input."""
    return jaxsph_command.main("jaxsph", argv)
