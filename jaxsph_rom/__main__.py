"""`python -m jaxsph_rom` is `jaxsph-rom`."""

import sys

from .cli import main

if __name__ == "__main__":
    sys.exit(main())
