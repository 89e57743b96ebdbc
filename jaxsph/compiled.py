"""How programs are compiled here: with the device's options, and matrix products in full."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, wraps

import equinox as eqx
import jax

from .compiler_options import platform_options


def full_precision(function: Callable) -> Callable:
    """The same function with matrix products in the precision of their factors.

    A GPU rounds the factors of float32 products to ten bits (TF32) unless it is told not to, which
    is an error of 1e-3 in a least-squares fit or a projection. A CPU does the same either way.
    """

    @wraps(function)
    def call(*arguments, **options):
        with jax.default_matmul_precision("highest"):
            return function(*arguments, **options)

    return call


def compiled(function: Callable) -> Callable:
    """`eqx.filter_jit(function)` so, with the options of the device that JAX has at first call."""

    @cache
    def program():
        return eqx.filter_jit(full_precision(function), compiler_options=platform_options())

    @wraps(function)
    def call(*arguments, **options):
        return program()(*arguments, **options)

    return call
