"""Where particles start: on a lattice, on a jittered lattice, packed, stirred, or on rings."""

from .base import Arrangement as Arrangement
from .jittered_lattice import JitteredLattice as JitteredLattice
from .lattice import Lattice as Lattice
from .packed import Packed as Packed
from .rings import Rings as Rings
from .stirred import Stirred as Stirred
