"""Differentiable smoothed-particle hydrodynamics in JAX.

What this package and the packages inside it hand on is public; modules inside these may change.
"""

from . import arrangements as arrangements
from . import effects as effects
from . import integrate as integrate
from . import interpolation as interpolation
from . import io as io
from . import kernels as kernels
from . import metrics as metrics
from . import scenes as scenes
from . import schemes as schemes
from .at_ghosts import AtGhost as AtGhost
from .at_ghosts import Mirrored as Mirrored
from .at_ghosts import Otherwise as Otherwise
from .at_ghosts import Same as Same
from .compiler_options import COMPILER_OPTIONS as COMPILER_OPTIONS
from .domain import Box as Box
from .fluid import Fluid as Fluid
from .fluid import LinearEquationOfState as LinearEquationOfState
from .fluid import TaitEquationOfState as TaitEquationOfState
from .full_model import FullModel as FullModel
from .functional import SPHFunctional as SPHFunctional
from .integrate import SimulationError as SimulationError
from .neighbors import CellGrid as CellGrid
from .neighbors import NeighborSearch as NeighborSearch
from .neighbors import VerletList as VerletList
from .neighbors import WalledSearch as WalledSearch
from .neighbors import WallList as WallList
from .pairs import PairTerm as PairTerm
from .pairs import Space as Space
from .pairs import pair_sum as pair_sum
from .particles import ParticleState as ParticleState
from .run_scene import run_scene as run_scene
from .schedule import Schedule as Schedule
from .simulate import simulate as simulate
from .sweeps import read_member as read_member
from .sweeps import read_status as read_status
from .sweeps import sweep as sweep
from .timing import Timing as Timing
from .trajectory import Snapshot as Snapshot
from .trajectory import Trajectory as Trajectory
from .vector import Vector as Vector
from .version import __version__ as __version__
from .wall_forces import WallForces as WallForces
from .walls import BallRegion as BallRegion
from .walls import BoxRegion as BoxRegion
from .walls import MovingBody as MovingBody
from .walls import MovingWall as MovingWall
from .walls import Region as Region
from .walls import SignedDistance as SignedDistance
from .walls import WallPart as WallPart
from .walls import Walls as Walls
