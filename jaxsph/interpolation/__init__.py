"""Interpolation of particle fields to other points, one rule a file."""

from .kernel_map import KernelMap as KernelMap
from .moving_least_squares import MovingLeastSquaresMap as MovingLeastSquaresMap
from .moving_least_squares import QuadraticMap as QuadraticMap
from .shepard import ShepardMap as ShepardMap
