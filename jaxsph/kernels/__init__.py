"""Smoothing kernels."""

from jaxsph.kernels.base import Kernel as Kernel
from jaxsph.kernels.quintic_spline import QuinticSpline as QuinticSpline
from jaxsph.kernels.wendland_c2 import WendlandC2 as WendlandC2
from jaxsph.kernels.wendland_c4 import WendlandC4 as WendlandC4
