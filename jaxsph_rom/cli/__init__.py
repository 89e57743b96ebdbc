"""The command line: `jaxsph-rom run`, `train`, `predict`, `suggest`, `show` and `advise`."""

from .main import main as main
from .options import PRODUCTS as PRODUCTS
