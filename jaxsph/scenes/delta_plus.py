"""The delta-plus-SPH scheme of the paper, as scenes without free surfaces list it."""

from __future__ import annotations

import jax.numpy as jnp

from ..effects import (
    Continuity,
    DensityDiffusion,
    Effect,
    ParticleShifting,
    PressureForce,
    ShiftingTransport,
)

DELTA = 0.1  # of the density diffusion


def delta_plus(dtype, *viscosity: Effect) -> tuple[Effect, ...]:
    """Continuity, pressure, viscosity if there is one, density diffusion, shifting and transport.

    Args:
        dtype: of coefficients.
        viscosity: none for an inviscid flow.
    """
    return (
        Continuity(),
        PressureForce(),
        *viscosity,
        DensityDiffusion(jnp.asarray(DELTA, dtype)),
        ParticleShifting(),
        ShiftingTransport(),
    )
