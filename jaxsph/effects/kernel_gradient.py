"""The sum of kernel gradients: zero among evenly spread particles, else towards the gaps."""

from ..at_ghosts import Same
from ..pairs import PairTerm


def kernel_gradient(pair, i, j):
    """grad_i W_ij V_j"""
    return pair.gradient


KERNEL_GRADIENT = PairTerm("kernel_gradient", (), kernel_gradient, Same())
