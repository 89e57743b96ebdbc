"""The command line: `jaxsph-rom run`, `train` and `predict`."""

from .main import main as main
from .options import PRODUCTS as PRODUCTS
