"""The sum of kernel gradients: zero among evenly spread particles, else towards the gaps."""

from ..pairs import PairTerm
from .base import WallTerm


def kernel_gradient(pair, i, j):
    """grad_i W_ij V_j"""
    return pair.gradient


KERNEL_GRADIENT = PairTerm("kernel_gradient", (), kernel_gradient)
WALL_KERNEL_GRADIENT = WallTerm("kernel_gradient", (), (), kernel_gradient)
