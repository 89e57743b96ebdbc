"""Where particles start: on a lattice, on a jittered lattice, or packed."""

from .base import Arrangement as Arrangement
from .jittered_lattice import JitteredLattice as JitteredLattice
from .lattice import Lattice as Lattice
from .packed import Packed as Packed
