"""What an effect is: a part of the physics that a scene may call for."""

from __future__ import annotations

import math
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..fluid import Fluid
from ..neighbors import VerletList
from ..pairs import PairTerm, Space
from ..parking import Parking
from ..particles import ParticleState
from ..wall_surface import Loads, WallSurface
from ..walls.moving_body import Bodies


class Context(NamedTuple):
    """What every effect may know of the scene it acts in."""

    time: Float[Array, ""]
    fluid: Fluid
    mass: Float[Array, ""]
    space: Space
    bodies: Bodies | None = None  # walls that move across themselves
    forces: tuple[Effect, ...] = ()  # the scene's body forces
    parking: Parking | None = None  # where particles wait, if some come in and go out
    pairs: VerletList | None = None  # of the fluid, for an effect that needs a further sum


def given(fields: dict, name: str, reader: Effect, giver: str) -> Array:
    """A field that an effect reads of one before it.

    Raises:
        ValueError: if none has given it.
    """
    if name not in fields:
        raise ValueError(f"effects: {reader.name} needs {giver} before it; list that first.")
    return fields[name]


VISCOUS_LIMIT = 0.125  # dt <= 0.125 h^2 / nu (Morris et al. 1997)


def viscous_step_limit(viscosity, space: Space):
    """0.125 h^2 / nu [s], infinite for nu = 0."""
    moving = viscosity > 0.0
    limit = VISCOUS_LIMIT * space.smoothing_length**2 / jnp.where(moving, viscosity, 1.0)
    return jnp.where(moving, limit, jnp.inf)


def parking_of(effects: tuple[Effect, ...]) -> Parking | None:
    """Where particles wait that are in no flow, if an effect lets some come in and go out.

    Raises:
        ValueError: if several effects do.
    """
    places = [place for place in (effect.parks_at() for effect in effects) if place is not None]
    if len(places) > 1:
        raise ValueError("effects: list all openings in one Openings; there are several of them.")
    return places[0] if places else None


class Effect(eqx.Module):
    """A part of the SPH functional, in two passes over the pairs.

    The first pass sees positions, densities, pressures, volumes and velocities; what an effect
    makes of its sums (`fields`) is there for the second pass, whose sums become rates of change of
    position [m/s], velocity [m/s^2] and density [kg/m^3/s]. One that needs more sums has
    `context.pairs` for them.

    Where a scene has walls, ghosts gather sums over the fluid particles near them first
    (`ghost_terms`), which give them their values (`ghost_fields`); in both passes they then add to
    a sum what its term says. Without walls neither is called.

    Which sums are wanted may hang on what of the context is static: its space, and whether there
    are forces and bodies.

    Coefficients that one may sweep or differentiate are array fields; what changes the structure
    of the computation is static.
    """

    @property
    def name(self) -> str:
        """The effect's name in reports and compiled programs."""
        return type(self).__name__

    def parks_at(self) -> Parking | None:
        """Where particles wait that are in no flow; None for an effect that puts none in."""
        return None

    @property
    def frees_surface(self) -> bool:
        """Whether the fluid may leave a part of its vessel or its box empty."""
        return False

    def on_fixed_points(self) -> tuple[Effect, ...]:
        """What the effect is at points that do not move: itself, unless it says otherwise.

        Raises:
            ValueError: if it has no meaning there.
        """
        return (self,)

    def step_limit(self, fluid: Fluid, space: Space) -> Float[Array, ""] | float:
        """The longest stable step [s] as far as this effect goes."""
        return math.inf

    def step_limit_from(
        self, position: Float[Array, "particles dim"], fluid: Fluid, space: Space
    ) -> float:
        """The same as far as it hangs on where particles start."""
        return math.inf

    def geometry_terms(self, context: Context) -> tuple[PairTerm, ...]:
        """Sums wanted of the first pass."""
        return ()

    def fields(self, context: Context, fields: dict, sums: dict) -> dict[str, Array]:
        """New per-particle fields made of the first pass's sums."""
        return {}

    def rate_terms(self, context: Context) -> tuple[PairTerm, ...]:
        """Sums wanted of the second pass."""
        return ()

    def rates(self, context: Context, fields: dict, sums: dict) -> dict[str, Array]:
        """Contributions to the rates of `position`, `velocity` and `density`."""
        return {}

    def governed(self, context: Context, fields: dict, rates: dict[str, Array]) -> dict[str, Array]:
        """The rates that all effects together give, as this one leaves them."""
        return rates

    def exchanged(
        self, state: ParticleState, since: Float[Array, "particles dim"], fluid: Fluid
    ) -> ParticleState:
        """A state with what has come in and gone out on the way from where particles were when
        their neighbour list was made."""
        return state

    def exhausted(self, position: Float[Array, "particles dim"], since) -> Bool[Array, ""] | bool:
        """Whether more have to come in than there are parked."""
        return False

    def transported(self, context: Context, fields: dict, sums: dict) -> dict[str, Array]:
        """Contributions that no effect governs: of a change of frame, as to points that stay."""
        return {}

    def on_walls(self, context: Context, fields: dict, surface: WallSurface) -> Loads | None:
        """What of the force on each part of the walls is in no sum over ghosts, if anything is."""
        return None

    def ghost_terms(self, context: Context) -> tuple[PairTerm, ...]:
        """Sums wanted for each ghost i over the fluid particles j near it.

        Where an effect's sums read what the first pass has made, its ghosts gather after that.
        """
        return ()

    def ghost_fields(self, context: Context, ghosts: dict, sums: dict) -> dict[str, Array]:
        """New fields of the ghosts made of these sums."""
        return {}
