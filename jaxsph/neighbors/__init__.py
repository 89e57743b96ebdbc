"""Fixed-capacity neighbour search: a cell grid, and the lists that it fills."""

from .cell_grid import CellBins as CellBins
from .cell_grid import CellGrid as CellGrid
from .verlet_list import CAPACITY_MARGIN as CAPACITY_MARGIN
from .verlet_list import NeighborSearch as NeighborSearch
from .verlet_list import VerletList as VerletList
from .verlet_list import check_periodic as check_periodic
from .wall_list import WalledSearch as WalledSearch
from .wall_list import WallList as WallList
from .wall_list import WallPairs as WallPairs
