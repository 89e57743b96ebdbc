"""What a scheme is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

from ..effects import BodyForce, Effect
from ..walls import Region


@dataclass(frozen=True)
class Scheme(ABC):
    """The effects that discretise a flow."""

    @abstractmethod
    def effects(
        self,
        viscosity: float | None = None,
        force: BodyForce | None = None,
        vessel: Region | None = None,
        wall_velocity: Effect | None = None,
    ) -> tuple[Effect, ...]:
        """The effects of a fluid that fills its box or its vessel.

        Args:
            viscosity: kinematic viscosity nu [m^2/s]; none for an inviscid flow.
            force: body force, if there is one.
            vessel: where fluid may be, if there are walls.
            wall_velocity: how viscosity sees these; the scheme's own no-slip if none is given.
        """

    @abstractmethod
    def free_surface_effects(
        self,
        *more: Effect,
        force: BodyForce | None = None,
        vessel: Region | None = None,
        wall_velocity: Effect | None = None,
    ) -> tuple[Effect, ...]:
        """The effects of a flow with a free surface.

        Args:
            more: viscosity, surface tension.
            force: body force, if there is one.
            vessel: where fluid may be, if there are walls.
            wall_velocity: how viscosity sees these; `FreeSlip()` if none is given.
        """
