"""The command line: `jaxsph scenes`, `run`, `sweep`, `show`, `watch`, `export` and `animate`."""

from jaxsph_command.errors import Parser as Parser
from jaxsph_command.errors import fail as fail
from jaxsph_command.errors import report_errors as report_errors

from .main import main as main
from .options import ARRANGEMENTS as ARRANGEMENTS
from .options import SCALES as SCALES
from .options import margin as margin
from .options import positive_float as positive_float
from .options import positive_int as positive_int
from .options import print_rows as print_rows
from .options import reynolds_numbers as reynolds_numbers
from .options import seed as seed
