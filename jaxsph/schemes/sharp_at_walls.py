"""The consistent scheme for flows that meet a body head-on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from ..effects import AdjointPressure
from .base import Scheme
from .consistent import Consistent


@final
@dataclass(frozen=True)
class SharpAtWalls(Scheme):
    """`Consistent` whose pressure and continuity are not smoothed beside walls.

    At a stagnation point the mean over a particle's neighbours is that of the fluid farther out,
    which still moves: with it the layer beside a body runs into its wall, and drag is too high
    (docs, "open boundaries"; judged there at h = 1.5 dx). Energy is conserved in the same way.
    """

    def effects(self, viscosity=None, force=None, vessel=None, wall_velocity=None):
        correction, _, *others = Consistent().effects(viscosity, force, vessel, wall_velocity)
        return (correction, AdjointPressure(boundary_smoothing=0.0), *others)

    def free_surface_effects(self, *more, force=None, vessel=None, wall_velocity=None):
        """Those of `Consistent`, which smooths nothing there."""
        return Consistent().free_surface_effects(
            *more, force=force, vessel=vessel, wall_velocity=wall_velocity
        )
