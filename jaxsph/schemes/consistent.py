"""The consistent scheme, whose energy does not grow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import jax.numpy as jnp

from ..effects import (
    AdjointPressure,
    ConsistentTransport,
    ConsistentViscosity,
    DensityDiffusion,
    KernelCorrection,
    LocalNoSlip,
    StrainShifting,
    WallRepulsion,
)
from .base import Scheme
from .delta_plus import DELTA


@final
@dataclass(frozen=True)
class Consistent(Scheme):
    """Pressure and continuity adjoint to each other, all other sums exact for linear fields.

    A fluid at rest stays at rest whatever its viscosity and however disordered its particles are,
    and what sound and waves carry is never more than they were given. For flows without a free
    surface, between walls that rest or slide along themselves.
    """

    def effects(self, dtype, viscosity=None, force=None, vessel=None, wall_velocity=None):
        viscous, driven, walls = (), (), ()
        if viscosity is not None:
            viscous = (ConsistentViscosity(jnp.asarray(viscosity, dtype)),)
        if force is not None:
            driven = (force,)
        if vessel is not None:
            slip = LocalNoSlip(vessel) if wall_velocity is None else wall_velocity
            walls = (slip, WallRepulsion(vessel))
        return (
            KernelCorrection(),
            AdjointPressure(),
            *viscous,
            DensityDiffusion(jnp.asarray(DELTA, dtype)),
            StrainShifting(),
            ConsistentTransport(),
            *driven,
            *walls,
        )
