"""Fixed-capacity neighbour search: a cell grid, and the Verlet list that it fills."""

from .cell_grid import CellBins as CellBins
from .cell_grid import CellGrid as CellGrid
from .verlet_list import CAPACITY_MARGIN as CAPACITY_MARGIN
from .verlet_list import NeighborSearch as NeighborSearch
from .verlet_list import VerletList as VerletList
