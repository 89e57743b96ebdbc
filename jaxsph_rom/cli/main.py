"""The `jaxsph-rom` command."""

from __future__ import annotations

import jaxsph_command


def main(argv: list[str] | None = None) -> int:
    """The `jaxsph-rom` command.

    Exit code 0: good, 1: a full run failed or all predicted members, 2: bad input.
    """
    return jaxsph_command.main("jaxsph-rom", argv)
