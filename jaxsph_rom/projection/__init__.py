"""Projections of the full rates onto a basis, one a file."""

from .adjoint_petrov_galerkin import AdjointPetrovGalerkin as AdjointPetrovGalerkin
from .base import Projection as Projection
from .base import PseudoInverse as PseudoInverse
from .galerkin import Galerkin as Galerkin
from .memory_length import ConvectiveMemory as ConvectiveMemory
from .memory_length import MemoryLength as MemoryLength
from .memory_length import SpectralMemory as SpectralMemory
from .memory_length import projected_jacobian as projected_jacobian
