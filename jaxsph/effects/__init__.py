"""Effects: the parts of the physics that a scene composes, one a file."""

from .artificial_viscosity import ArtificialViscosity as ArtificialViscosity
from .background_pressure import BackgroundPressure as BackgroundPressure
from .base import Context as Context
from .base import Effect as Effect
from .base import WallTerm as WallTerm
from .body_force import BodyForce as BodyForce
from .body_force import CentralForce as CentralForce
from .body_force import Gravity as Gravity
from .body_force import KickAndHold as KickAndHold
from .continuity import Continuity as Continuity
from .density_diffusion import DensityDiffusion as DensityDiffusion
from .free_surface import FreeSurface as FreeSurface
from .isotropic_viscosity import IsotropicViscosity as IsotropicViscosity
from .laminar_viscosity import LaminarViscosity as LaminarViscosity
from .particle_shifting import ParticleShifting as ParticleShifting
from .pressure_force import PressureForce as PressureForce
from .shifting_transport import ShiftingTransport as ShiftingTransport
from .surface_diffusion import SurfaceDiffusion as SurfaceDiffusion
from .surface_shifting import SurfaceShifting as SurfaceShifting
from .surface_tension import SurfaceTension as SurfaceTension
from .tensile_control import TensileControl as TensileControl
from .wall_pressure import WallPressure as WallPressure
from .wall_repulsion import WallRepulsion as WallRepulsion
from .wall_velocity import FixedWallVelocity as FixedWallVelocity
from .wall_velocity import FreeSlip as FreeSlip
from .wall_velocity import NoSlip as NoSlip
