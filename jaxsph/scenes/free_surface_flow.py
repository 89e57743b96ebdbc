"""What all flows with a free surface share: the consistent delta-plus scheme (Sun et al. 2019)."""

from __future__ import annotations

import jax.numpy as jnp

from ..effects import (
    BodyForce,
    Continuity,
    DensityDiffusion,
    Effect,
    FreeSlip,
    FreeSurface,
    ParticleShifting,
    PressureForce,
    ShiftingTransport,
    SurfaceDiffusion,
    SurfaceShifting,
    TensileControl,
    WallPressure,
    WallRepulsion,
)
from ..schemes.delta_plus import DELTA
from ..walls import Region


def free_surface_effects(
    dtype,
    *more: Effect,
    force: BodyForce | None = None,
    vessel: Region | None = None,
    wall_velocity: Effect | None = None,
) -> tuple[Effect, ...]:
    """The effects of a flow with a free surface.

    Args:
        dtype: of coefficients.
        more: viscosity, surface tension.
        force: body force, if there is one.
        vessel: where fluid may be, if there are walls.
        wall_velocity: how viscosity sees these; `FreeSlip()` if none is given.
    """
    walls: tuple[Effect, ...] = ()
    if vessel is not None:
        slip = FreeSlip() if wall_velocity is None else wall_velocity
        walls = (WallPressure(), slip, WallRepulsion(vessel))
    return (
        Continuity(),
        PressureForce(),
        DensityDiffusion(jnp.asarray(DELTA, dtype)),
        ParticleShifting(),
        FreeSurface(),
        SurfaceShifting(),
        SurfaceDiffusion(),
        TensileControl(),
        ShiftingTransport(),
        *more,
        *(() if force is None else (force,)),
        *walls,
    )
