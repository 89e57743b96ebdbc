"""Schemes: which effects make a flow out of a viscosity, a force and walls, one a file."""

from .base import Scheme as Scheme
from .consistent import Consistent as Consistent
from .delta_plus import DELTA as DELTA
from .delta_plus import DeltaPlus as DeltaPlus
from .delta_plus import delta_plus as delta_plus
from .sharp_at_walls import SharpAtWalls as SharpAtWalls

SCHEMES = {
    "delta-plus": DeltaPlus(),
    "consistent": Consistent(),
    "sharp-at-walls": SharpAtWalls(),
}
