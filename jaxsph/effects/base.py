"""What an effect is: a part of the physics that a scene may call for."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..fluid import Fluid
from ..pairs import PairTerm, Space
from ..walls.moving_body import Bodies


class Context(NamedTuple):
    """What every effect may know of the scene it acts in."""

    time: Float[Array, ""]
    fluid: Fluid
    mass: Float[Array, ""]
    space: Space
    bodies: Bodies | None = None
    forces: tuple[Effect, ...] = ()  # the scene's body forces


class WallTerm(NamedTuple):
    """What ghosts add to the sum of that name: `function(pair, i, j)` for particle i and ghost j.

    `reads` names fields of the particle, `ghost_reads` those of the ghost. Positions, volumes,
    normals and wall velocities are always there; the scene's wall effects give the others.
    """

    name: str
    reads: tuple[str, ...]
    ghost_reads: tuple[str, ...]
    function: Callable


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


class Effect(eqx.Module):
    """A part of the SPH functional, in at most three passes over the pairs.

    The first pass sees positions, densities, pressures, volumes and velocities; what an effect
    makes of its sums (`fields`) is there for the second pass, whose sums become rates of change of
    position [m/s], velocity [m/s^2] and density [kg/m^3/s].

    Where a scene has walls, a pass over the ghosts comes first: its sums over fluid particles
    (`ghost_terms`) give the ghosts their values (`ghost_fields`); and in both other passes ghosts
    add to the sums what an effect's `wall_geometry_terms` and `wall_rate_terms` say. Ghosts may
    gather once more what the first pass has made (`handing_terms`, `handing_fields`) and hand it on
    in the second. Without walls none of these is called. A last pass over the fluid's pairs
    (`closing_terms`) may read fields made of the second's sums (`closing_fields`). Where bodies are
    moved through the fluid, ghosts have a `wall_acceleration` [m/s^2] as well, and the `moving_`
    forms of these methods are called.

    Coefficients that one may sweep or differentiate are array fields; what changes the structure
    of the computation is static.
    """

    @property
    def name(self) -> str:
        """The effect's name in reports and compiled programs."""
        return type(self).__name__

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

    def geometry_terms(self, space: Space) -> tuple[PairTerm, ...]:
        """Sums wanted of the first pass."""
        return ()

    def fields(self, context: Context, fields: dict, sums: dict) -> dict[str, Array]:
        """New per-particle fields made of the first pass's sums."""
        return {}

    def rate_terms(self, space: Space) -> tuple[PairTerm, ...]:
        """Sums wanted of the second pass."""
        return ()

    def ghost_terms(self, space: Space) -> tuple[PairTerm, ...]:
        """Sums wanted for each ghost i over the fluid particles j near it."""
        return ()

    def ghost_fields(self, context: Context, ghosts: dict, sums: dict) -> dict[str, Array]:
        """New fields of the ghosts made of these sums."""
        return {}

    def wall_geometry_terms(self, space: Space) -> tuple[WallTerm, ...]:
        """What ghosts add to sums of the first pass."""
        return ()

    def wall_rate_terms(self, space: Space) -> tuple[WallTerm, ...]:
        """What ghosts add to sums of the second pass."""
        return ()

    def handing_terms(self, space: Space) -> tuple[PairTerm, ...]:
        """Sums wanted for each ghost i over the fluid particles j, of the first pass's fields."""
        return ()

    def handing_fields(self, context: Context, ghosts: dict, sums: dict) -> dict[str, Array]:
        """New fields of the ghosts made of these sums, for the second pass."""
        return {}

    def closing_fields(self, context: Context, fields: dict, sums: dict) -> dict[str, Array]:
        """New per-particle fields made of the second pass's sums, for the last."""
        return {}

    def closing_terms(self, space: Space) -> tuple[PairTerm, ...]:
        """Sums wanted of the last pass."""
        return ()

    def moving_ghost_terms(self, space: Space) -> tuple[PairTerm, ...]:
        """`ghost_terms` where walls move across themselves."""
        return self.ghost_terms(space)

    def moving_wall_geometry_terms(self, space: Space) -> tuple[WallTerm, ...]:
        """`wall_geometry_terms` where walls move across themselves."""
        return self.wall_geometry_terms(space)

    def moving_wall_rate_terms(self, space: Space) -> tuple[WallTerm, ...]:
        """`wall_rate_terms` where walls move across themselves."""
        return self.wall_rate_terms(space)

    def rates(self, context: Context, fields: dict, sums: dict) -> dict[str, Array]:
        """Contributions to the rates of `position`, `velocity` and `density`."""
        return {}
