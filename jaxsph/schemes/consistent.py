"""The consistent scheme, whose energy does not grow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import jax.numpy as jnp

from .. import effects as known
from ..effects import (
    AdjointContinuity,
    AdjointPressure,
    ConsistentTransport,
    ConsistentViscosity,
    DensityDiffusion,
    GrippedPressureForce,
    KernelCorrection,
    LocalNoSlip,
    PairRepulsion,
    StrainShifting,
    VelocityDiffusion,
    WallPressure,
    WallRepulsion,
)
from .base import Scheme
from .delta_plus import DELTA, free_walls

VELOCITY_DELTA = 0.05  # of the velocity diffusion at free surfaces


@final
@dataclass(frozen=True)
class Consistent(Scheme):
    """Pressure and continuity adjoint to each other, all other sums exact for linear fields.

    A fluid at rest stays at rest whatever its viscosity and however disordered its particles are,
    and what sound and waves carry is never more than they were given. Between walls that rest or
    slide along themselves; with a free surface bodies may be moved through the fluid, too, and the
    sums are the plain ones, as support is cut there.
    """

    def effects(self, viscosity=None, force=None, vessel=None, wall_velocity=None):
        viscous, driven, walls = (), (), ()
        if viscosity is not None:
            viscous = (ConsistentViscosity(jnp.asarray(viscosity, float)),)
        if force is not None:
            driven = (force,)
        if vessel is not None:
            slip = LocalNoSlip(vessel) if wall_velocity is None else wall_velocity
            walls = (slip, WallRepulsion(vessel))
        return (
            KernelCorrection(),
            AdjointPressure(),
            *viscous,
            DensityDiffusion(jnp.asarray(DELTA)),
            StrainShifting(),
            ConsistentTransport(),
            PairRepulsion(),
            *driven,
            *walls,
        )

    def free_surface_effects(self, *more, force=None, vessel=None, wall_velocity=None):
        """Plain pairwise sums, with a continuity of walls that does not pump."""
        walls = () if vessel is None else (WallPressure(), *free_walls(vessel, wall_velocity))
        return (
            KernelCorrection(),
            AdjointContinuity(),
            GrippedPressureForce(),
            DensityDiffusion(jnp.asarray(DELTA)),
            StrainShifting(),
            known.FreeSurface(),
            VelocityDiffusion(jnp.asarray(VELOCITY_DELTA)),
            known.SurfaceShifting(),
            known.SurfaceDiffusion(),
            known.TensileControl(),
            ConsistentTransport(),
            PairRepulsion(),
            *more,
            *(() if force is None else (force,)),
            *walls,
        )
