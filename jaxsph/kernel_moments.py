"""Moments of a kernel's slope and of the kernel itself, in the continuum and on the lattice."""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import product

import jax
import jax.numpy as jnp
import numpy as np

from .kernels import Kernel

_STEPS = 4000  # of the midpoint rule; six digits


@lru_cache
def slope_moment(kernel: Kernel, dim: int, power: int) -> float:
    """Integral of q^(power + dim - 1) F(q) dq over the support, F = -W'(q) / q at h = 1."""
    q = (np.arange(_STEPS) + 0.5) / _STEPS * kernel.support
    weights = -_evaluated(kernel.gradient_over_r, q, 1.0, dim)
    return float(np.sum(q ** (power + dim - 1) * weights) * kernel.support / _STEPS)


@lru_cache
def lattice_moments(kernel: Kernel, dim: int, h_over_dx: float) -> dict[str, float]:
    """Sums over the neighbours of a lattice's point, in units of the spacing.

    `kernel`: sum W; `kernel_2`: sum W r^2; `slope_2`, `slope_4`: sums F r^2 and F r^4, F = -W'/r.
    """
    reach = math.ceil(kernel.support * h_over_dx)
    offsets = np.array(list(product(range(-reach, reach + 1), repeat=dim)), float)
    r = np.linalg.norm(offsets, axis=1)
    r = r[r > 0.0]
    value = _evaluated(kernel.value, r, h_over_dx, dim)
    slope = -_evaluated(kernel.gradient_over_r, r, h_over_dx, dim)
    return {
        "kernel": float(value.sum()),
        "kernel_2": float((value * r**2).sum()),
        "slope_2": float((slope * r**2).sum()),
        "slope_4": float((slope * r**4).sum()),
    }


def _evaluated(function, distances: np.ndarray, h: float, dim: int) -> np.ndarray:
    with jax.ensure_compile_time_eval():
        compiled = jax.jit(function, static_argnums=2)
        return np.asarray(compiled(jnp.asarray(distances), h, dim), float)
