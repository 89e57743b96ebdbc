"""Effects: the parts of the physics that a scene composes, one a file."""

from .base import Context as Context
from .base import Effect as Effect
from .continuity import Continuity as Continuity
from .density_diffusion import DensityDiffusion as DensityDiffusion
from .laminar_viscosity import LaminarViscosity as LaminarViscosity
from .particle_shifting import ParticleShifting as ParticleShifting
from .pressure_force import PressureForce as PressureForce
from .shifting_transport import ShiftingTransport as ShiftingTransport
