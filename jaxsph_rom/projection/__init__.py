"""Projections of the full rates onto a basis, one a file."""

from .adjoint_petrov_galerkin import AdjointPetrovGalerkin as AdjointPetrovGalerkin
from .base import Projection as Projection
from .base import PseudoInverse as PseudoInverse
from .galerkin import Galerkin as Galerkin
