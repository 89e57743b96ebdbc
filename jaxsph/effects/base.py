"""What an effect is: a part of the physics that a scene may call for."""

from __future__ import annotations

from typing import NamedTuple

import equinox as eqx
from jaxtyping import Array, Float

from ..fluid import Fluid
from ..pairs import PairTerm, Space


class Context(NamedTuple):
    """What every effect may know of the scene it acts in."""

    time: Float[Array, ""]
    fluid: Fluid
    mass: Float[Array, ""]
    space: Space


class Effect(eqx.Module):
    """A part of the SPH functional, in at most two passes over the pairs.

    The first pass sees positions, densities, pressures, volumes and velocities; what an effect
    makes of its sums (`fields`) is there for the second pass, whose sums become rates of change of
    position [m/s], velocity [m/s^2] and density [kg/m^3/s].

    Coefficients that one may sweep or differentiate are array fields; what changes the structure
    of the computation is static.
    """

    @property
    def name(self) -> str:
        """The effect's name in reports and compiled programs."""
        return type(self).__name__

    def geometry_terms(self, space: Space) -> tuple[PairTerm, ...]:
        """Sums wanted of the first pass."""
        return ()

    def fields(self, context: Context, fields: dict, sums: dict) -> dict[str, Array]:
        """New per-particle fields made of the first pass's sums."""
        return {}

    def rate_terms(self, space: Space) -> tuple[PairTerm, ...]:
        """Sums wanted of the second pass."""
        return ()

    def rates(self, context: Context, fields: dict, sums: dict) -> dict[str, Array]:
        """Contributions to the rates of `position`, `velocity` and `density`."""
        return {}
