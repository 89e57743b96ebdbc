"""The commands' front: what answers before anything heavy is imported.

An interrupt is one line from the first import on, `--help` and the list of scenes need no JAX, and
of all commands only the one that is named is imported.
"""

import sys

from .commands import main as main


def jaxsph() -> int:
    """The `jaxsph` command."""
    return _started("jaxsph")


def jaxsph_rom() -> int:
    """The `jaxsph-rom` command."""
    return _started("jaxsph-rom")


def _started(program: str) -> int:
    try:
        return main(program)
    except KeyboardInterrupt:
        print(f"{program}: error: interrupted.", file=sys.stderr)
        return 130
