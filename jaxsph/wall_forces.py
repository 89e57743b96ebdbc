"""The force of the fluid on its walls and on named parts of them."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float
from scipy.spatial import cKDTree

from .compiled import compiled, full_precision
from .full_model import FullModel
from .functional import SPHFunctional
from .neighbors import WallList
from .particles import ParticleState
from .shown import concrete
from .wall_loads import ghost_loads
from .wall_surface import Loads, WallSurface
from .walls.distances import distances
from .walls.parts import WHOLE
from .walls.surface import surface
from .walls.turning import Turning
from .walls.walls import ghosts_in

_ENLARGEMENTS = 8  # of the neighbour list, each by a fifth


class WallForces(eqx.Module):
    """Force and torque on the walls, from the very sums that act on the fluid:

        F_B = -m sum_i sum_g (d sum_k (du_k/dt) / dS_i) . s_ig,

    s_ig what a ghost g of a part B adds to the sums S_i of the second pass, in which the rates of
    velocity are affine; the fields made of the first pass stay as they are. So action equals
    reaction to round-off for every effect that has ghosts. The force of a pair acts where the line
    between its two crosses the wall. Forces on the walls beside these sums,
    of a pressure that is taken out of them or of a repulsion, are added by their own effects
    (docs, "forces on walls").

    Args:
        names: of the parts, all the walls together first (static).
        reference_lengths: L of each part [m] (static).
        reference_speeds: U of each part [m/s] (static).
        density: rho0 [kg/m^3] (static).
        held: which ghosts belong to each part.
        points, areas, parts: as those of `WallSurface`.
        turning: of walls that turn along themselves, if any do.

    Examples:
        >>> import jax.numpy as jnp
        >>> import jaxsph
        >>> tank = jaxsph.scenes.hydrostatic_tank(16)
        >>> forces, torques = jaxsph.WallForces.of(tank)(tank.model(), jnp.zeros(()), tank.state)
        >>> round(float(forces["walls"][1]), -1)  # N/m: 1000 kg of water, g = 1 m/s^2
        -1000.0
    """

    names: tuple[str, ...] = eqx.field(static=True)
    reference_lengths: tuple[float, ...] = eqx.field(static=True)
    reference_speeds: tuple[float, ...] = eqx.field(static=True)
    density: float = eqx.field(static=True)
    held: Bool[Array, "parts ghosts"]
    points: Float[Array, "points dim"]
    areas: Float[Array, "points dim"]
    parts: Bool[Array, "parts points"]
    turning: Turning | None = None

    @classmethod
    def of(cls, scene: Any) -> WallForces | None:
        """Those of a scene; None if it has no walls."""
        walls, space = scene.walls, scene.space
        if walls is None:
            return None
        ghosts = np.asarray(walls.position)
        own = ghosts_in([part.region for part in walls.parts], ghosts, space.spacing)
        held = [np.ones(len(ghosts), bool), *own]
        points, areas, behind = surface(walls.fluid_region, space)
        _, nearest = cKDTree(ghosts).query(behind)
        lengths = [float(np.ptp(ghosts[own], axis=0).max() + space.spacing) for own in held]
        lengths[1:] = [
            part.reference_length or length
            for part, length in zip(walls.parts, lengths[1:], strict=True)
        ]
        here, velocity = np.asarray(walls.normal), np.asarray(walls.velocity)
        here = ghosts + distances(walls.start_region, ghosts)[:, None] * here
        of_parts = np.stack([own[nearest] for own in held])
        speed, dtype = float(scene.fluid.reference_speed), walls.position.dtype
        return cls(
            (WHOLE, *(part.name for part in walls.parts)),
            tuple(lengths),
            (speed, *(part.reference_speed or speed for part in walls.parts)),
            float(scene.fluid.reference_density),
            jnp.asarray(np.stack(held)),
            jnp.asarray(points, dtype),
            jnp.asarray(areas, dtype),
            jnp.asarray(of_parts),
            Turning.of(here, velocity, np.stack(held), of_parts),
        )

    def __call__(
        self, model: FullModel, time: Float[Array, ""], state: ParticleState
    ) -> tuple[dict[str, Array], dict[str, Array]]:
        """Forces (n,) [N] of the fluid on each part, and torques about the origin [N m], scalars in
        two dimensions, by name; of a metre's depth in two dimensions.

        A neighbour list without room is allocated anew. Inside another program, which cannot be
        compiled anew, forces are NaN then.

        Args:
            model: of the scene.
            time: [s].
            state: the particles then.

        Raises:
            ValueError: if a list four times as large does not hold all pairs.
        """
        if concrete(*jax.tree.leaves(eqx.filter((model, time, state), eqx.is_array))):
            found = _whole(self, model, time, state)
        else:  # in another program, which has compiler options of its own
            found = loads(self, model, time, state)
        return tuple(dict(zip(self.names, value, strict=True)) for value in found)


def named(forces: WallForces | None) -> WallForces | None:
    """The same if parts of the walls have names: then a run knows their means over time, too."""
    return forces if forces is not None and len(forces.names) > 1 else None


def loads(
    forces: WallForces, model: FullModel, time: Float[Array, ""], state: ParticleState
) -> Loads:
    """Forces (K, n) and torques on all parts; pure, so differentiate and map it. NaN where the
    neighbour list does not hold all pairs."""
    return guarded(forces, model, time, state)[0]


@full_precision
def loads_of(
    forces: WallForces, functional: SPHFunctional, passed: tuple, neighbors: WallList
) -> Loads:
    """The same of what `functional.passes` found by a neighbour list; NaN where it overflowed."""
    context, fields, *_ = passed
    position = fields["position"]
    held = forces.held[:, neighbors.wall.ghosts].astype(position.dtype)
    walls = functional.walls_then(context)
    on_ghosts, shares = ghost_loads(functional.effects, walls, passed, neighbors, held)
    turning = None if forces.turning is None else forces.turning.gradient(walls.velocity)
    seen = WallSurface(forces.points, forces.areas, forces.parts, position, shares, turning)
    found = [jax.tree.map(lambda each: held @ each, on_ghosts)]
    found += [effect.on_walls(context, fields, seen) for effect in functional.effects]
    found = [each for each in found if each is not None]
    whole = jax.tree.map(lambda *a: sum(a[1:], a[0]), *found)
    return jax.tree.map(lambda a: jnp.where(neighbors.overflow, jnp.nan, a), whole)


def guarded(forces: WallForces, model: FullModel, time, state) -> tuple[Loads, Bool[Array, ""]]:
    """The loads, and whether the neighbour list overflowed."""
    neighbors = model.at(time).prepare(state)
    passed = model.functional.passes(time, state, neighbors)
    return loads_of(forces, model.functional, passed, neighbors), neighbors.overflow


_measured = compiled(guarded)


def _whole(forces: WallForces, model: FullModel, time, state) -> Loads:
    """The loads by a list that holds all pairs: the run has not built it, nobody else will see."""
    for _ in range(_ENLARGEMENTS + 1):
        found, overflow = _measured(forces, model, time, state)
        if not overflow:
            return found
        model = model.enlarged()
    raise ValueError("state: particles clump, far more beside each other than at rest.")
