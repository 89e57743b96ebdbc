"""Effects: the parts of the physics that a scene composes, one a file."""

from .base import Context as Context
from .base import Effect as Effect
from .base import WallTerm as WallTerm
from .body_force import BodyForce as BodyForce
from .body_force import Gravity as Gravity
from .body_force import KickAndHold as KickAndHold
from .continuity import Continuity as Continuity
from .density_diffusion import DensityDiffusion as DensityDiffusion
from .isotropic_viscosity import IsotropicViscosity as IsotropicViscosity
from .laminar_viscosity import LaminarViscosity as LaminarViscosity
from .particle_shifting import ParticleShifting as ParticleShifting
from .pressure_force import PressureForce as PressureForce
from .shifting_transport import ShiftingTransport as ShiftingTransport
from .wall_pressure import WallPressure as WallPressure
from .wall_repulsion import WallRepulsion as WallRepulsion
from .wall_velocity import FixedWallVelocity as FixedWallVelocity
from .wall_velocity import FreeSlip as FreeSlip
from .wall_velocity import NoSlip as NoSlip
