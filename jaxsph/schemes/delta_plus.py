"""The delta-plus-SPH scheme of the paper."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import jax.numpy as jnp

from .. import effects as known
from ..effects import (
    Continuity,
    DensityDiffusion,
    Effect,
    LaminarViscosity,
    NoSlip,
    ParticleShifting,
    PressureForce,
    ShiftingTransport,
    WallPressure,
    WallRepulsion,
)
from .base import Scheme

DELTA = 0.1  # of the density diffusion


def delta_plus(*viscosity: Effect) -> tuple[Effect, ...]:
    """Continuity, pressure, viscosity if there is one, density diffusion, shifting and transport.

    Args:
        viscosity: none for an inviscid flow.
    """
    return (
        Continuity(),
        PressureForce(),
        *viscosity,
        DensityDiffusion(jnp.asarray(DELTA)),
        ParticleShifting(),
        ShiftingTransport(),
    )


@final
@dataclass(frozen=True)
class DeltaPlus(Scheme):
    """The paper's scheme, with generalised walls (Adami et al. 2012).

    It makes energy from nothing where viscosity is low: disordered particles at rest speed up, by
    the shift-velocity terms everywhere and by the continuity of walls beside these
    (`benchmarks.schemes`). What reproduces the paper names it.
    """

    def effects(self, viscosity=None, force=None, vessel=None, wall_velocity=None):
        viscous = ()
        if viscosity is not None:
            viscous = (LaminarViscosity(jnp.asarray(viscosity, float)),)
        effects = delta_plus(*viscous)
        if force is not None:
            effects = (*effects, force)
        if vessel is None:
            return effects
        slip = NoSlip() if wall_velocity is None else wall_velocity
        return (*effects, WallPressure(), slip, WallRepulsion(vessel))

    def free_surface_effects(self, *more, force=None, vessel=None, wall_velocity=None):
        """The consistent delta-plus scheme (Sun et al. 2019)."""
        # looked up when called: what other flows are made of does not hang on these
        bulk = delta_plus()
        walls = () if vessel is None else (WallPressure(), *free_walls(vessel, wall_velocity))
        return (
            *bulk[:-1],
            known.FreeSurface(),
            known.SurfaceShifting(),
            known.SurfaceDiffusion(),
            known.TensileControl(),
            bulk[-1],
            *more,
            *(() if force is None else (force,)),
            *walls,
        )


def free_walls(vessel, wall_velocity) -> tuple[Effect, ...]:
    """Walls of a flow with a free surface, slippery if nothing else is asked."""
    return (known.FreeSlip() if wall_velocity is None else wall_velocity, WallRepulsion(vessel))
