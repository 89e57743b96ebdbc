"""Where the commands start: an interrupt is one line from the first import on."""

import sys
from importlib import import_module


def jaxsph() -> int:
    """The `jaxsph` command."""
    return _started("jaxsph", "jaxsph.cli")


def jaxsph_rom() -> int:
    """The `jaxsph-rom` command."""
    return _started("jaxsph-rom", "jaxsph_rom.cli")


def _started(program: str, module: str) -> int:
    try:
        return import_module(module).main()
    except KeyboardInterrupt:
        print(f"{program}: error: interrupted.", file=sys.stderr)
        return 130
