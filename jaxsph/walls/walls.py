"""Walls as layers of ghost particles (Adami, Hu and Adams 2012)."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import final

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..body_state import BodyState
from ..pairs import Space
from .distances import distance_in, distances, slope_in, slopes
from .free_body import FreeBodies, FreeBody, checked
from .moving_body import Bodies, MovingBody
from .parts import WallPart
from .refusals import (
    place,
    refuse_gaps,
    refuse_seams,
    refuse_thin_walls,
    refuse_torn_walls,
)
from .region import Region
from .rows import put_in_rows, rows_along

_HAIR = 1e-4  # times its depth: so near the surface a ghost is asked for the wall's velocity
_FLAT = 0.5  # slope of a signed distance, below which it does not tell where the surface is
_ON_SURFACE = 1e-3  # times dx: a ghost that near a part's surface lies on it


@final
@dataclass(frozen=True)
class MovingWall:
    """A part of a wall that slides along itself, a lid say.

    Args:
        part: region that holds the ghosts of this part.
        velocity: places on the wall (G, n) [m] -> its velocities there (G, n) [m/s].
    """

    part: Region
    velocity: Callable[[Array], Array]


class Walls(eqx.Module):
    """Ghost particles around a region of fluid.

    Args:
        position: of the ghosts (G, n) [m].
        normal: unit normals (G, n) of the nearest wall, towards the fluid.
        velocity: of the wall at each ghost (G, n) [m/s].
        fluid_region: where fluid may be, but for moving bodies (static).
        bodies: that move across themselves, if there are any, where they are now.
        parts: whose forces are told apart (static).
    """

    position: Float[Array, "ghosts dim"]
    normal: Float[Array, "ghosts dim"]
    velocity: Float[Array, "ghosts dim"]
    fluid_region: Region = eqx.field(static=True)
    bodies: Bodies | None = None
    # what is told of a run does not make it another run: `content` leaves it out
    parts: tuple[WallPart, ...] = eqx.field(static=True, default=(), compare=False)

    @classmethod
    def around(
        cls,
        fluid_region: Region,
        space: Space,
        moving: Sequence[MovingWall] = (),
        layers: int | None = None,
        bodies: Sequence[MovingBody] = (),
        parts: Sequence[WallPart] = (),
        free_bodies: Sequence[FreeBody] = (),
        opening: Region | None = None,
        in_rows: Sequence[Region] = (),
    ) -> Walls:
        """Ghosts on the lattice of `space`, continued into the walls around a region of fluid, some
        of them in rows along a surface.

        Args:
            fluid_region: where fluid may be; everything else in and around the box is wall.
            space: its box encloses the fluid; closed directions end at walls.
            moving: parts of the walls that move along themselves; all others are at rest.
            layers: of ghosts; as many as fill the kernel's support if none is given. The paper's
                three leave a particle beside the wall a support that is not full.
            bodies: that are moved through that region. Where one meets a fixed wall it must reach
                the kernel's support deep into the region, and should stay that far in.
            parts: of the walls, moving bodies among them, whose forces are recorded by name.
            free_bodies: that the fluid moves; as far from fixed walls as above.
            opening: where the fluid may reach past the box's faces, through the buffers of
                `jaxsph.effects.Openings`.
            in_rows: parts of the fixed walls, in two dimensions, whose ghosts are in rows along
                their surface; for curved ones away from others, of which the lattice makes stairs.

        Raises:
            ValueError: for a gap in the walls, a wall too thin, a moving part without a wall or
                that does not move along it, a body without room in the region or too thin, or a
                named part without a ghost; for rows in three dimensions, or where no fixed wall is.

        Examples:
            >>> import jax.numpy as jnp
            >>> from jaxsph import Box, SignedDistance, Space, Walls
            >>> from jaxsph.kernels import WendlandC2
            >>> box = Box((0.0, 0.0), (2.0, 2.0), (False, False))
            >>> space = Space(box, WendlandC2(), smoothing_length=0.2, spacing=0.1)
            >>> disc = SignedDistance(lambda x: jnp.linalg.norm(x - 1.0, axis=1) - 1.0)
            >>> walls = Walls.around(disc, space)
            >>> bool((disc.signed_distance(walls.position) >= 0.0).all())  # ghosts are outside
            True
        """
        full = math.ceil(space.support / space.spacing - 1e-9)
        layers = full if layers is None else layers
        if layers < 1:
            raise ValueError(f"layers: at least 1 layer of ghosts, got {layers}.")
        distance = partial(distances, fluid_region)
        refuse_gaps(distance, space, opening)
        refuse_torn_walls(distance, space)
        lattice = space.lattice(layers)
        depth = distance(lattice)
        thickness = layers * space.spacing
        ghosts = lattice[(depth >= 0.0) & (depth < thickness)]
        if in_rows:
            slope = partial(slopes, fluid_region)
            rows = rows_along(distance, slope, space, layers)
            ghosts = put_in_rows(ghosts, rows, in_rows, partial(ghosts_in, spacing=space.spacing))
        beside = lattice[(depth < 0.0) & (depth > -space.spacing)]
        refuse_seams(distance, space, beside, slopes(fluid_region, beside))
        moved = (*bodies, *free_bodies)
        for body in free_bodies:
            checked(body, space.box)
        if not len(ghosts) and not moved:
            raise ValueError(
                "walls: the region of fluid leaves no place for a wall; let the box be closed in "
                "some direction, or the region smaller than the box."
            )
        normal = _normals(fluid_region, ghosts, space.spacing)
        depth = distance(ghosts)[:, None]
        refuse_thin_walls(distance, space, ghosts + depth * normal, normal)
        skin = ghosts + (1.0 - _HAIR) * depth * normal
        velocity = np.zeros_like(ghosts)
        of_lids = ghosts_in([lid.part for lid in moving], ghosts, space.spacing)
        for lid, held in zip(moving, of_lids, strict=True):
            if not held.any():
                raise ValueError(
                    f"moving wall: no ghost lies in {lid.part}; a lid needs a wall to sit in. Let "
                    "its part cover ghosts beyond the fluid."
                )
            velocity[held] = np.asarray(lid.velocity(jnp.asarray(skin[held])))
            across = np.abs((velocity * normal).sum(axis=1))[held]
            speed = np.linalg.norm(velocity[held], axis=1)
            if np.median(across) > 0.1 * np.median(speed):  # at corners normals are oblique
                raise ValueError(
                    f"moving wall: the velocity of {lid.part} is across the wall; walls slide "
                    "along themselves only."
                )
        here = [jnp.asarray(a) for a in (ghosts, normal, velocity)]
        if not moved:
            _check_parts(parts, ghosts, space.spacing)
            return cls(*here, fluid_region, None, tuple(parts))
        position, normal, number = _body_ghosts(fluid_region, moved, space, thickness)
        number = np.concatenate([np.full(len(ghosts), len(moved)), number])
        more = (position, normal, np.zeros_like(position))
        here = [jnp.concatenate([a, jnp.asarray(b)]) for a, b in zip(here, more, strict=True)]
        free = None
        if free_bodies:
            own = (number >= len(bodies)) & (number < len(moved))
            owner = jnp.asarray(np.where(own, number - len(bodies), len(free_bodies)), jnp.int32)
            free = FreeBodies.at_start(free_bodies, owner, *here[:2], space)
            here[2] = here[2] + free.ghost_velocity(*here[:2])
        owner = jnp.asarray(np.where(number < len(bodies), number, len(bodies)), jnp.int32)
        start = Bodies.at_start(bodies, owner, space.box, free)
        here[2] = here[2] + start.of_ghosts(start.velocity)
        _check_parts(parts, np.asarray(here[0]), space.spacing)
        return cls(*here, fluid_region, start, tuple(parts))

    @property
    def start_region(self) -> Region:
        """Where fluid may be at t = 0, outside the bodies."""
        bodies = self.bodies
        if bodies is None:
            return self.fluid_region
        free = () if bodies.free is None else bodies.free.parts
        return _without(self.fluid_region, (*bodies.parts, *free))

    @property
    def fixed_position(self) -> Float[np.ndarray, "ghosts dim"]:
        """Places of the ghosts that are no part of a moving body [m]."""
        position = np.asarray(self.position)
        if self.bodies is None:
            return position
        fixed = np.asarray(self.bodies.owner) == len(self.bodies.parts)
        if self.bodies.free is not None:
            fixed &= np.asarray(self.bodies.free.owner) == len(self.bodies.free.parts)
        return position[fixed]

    @property
    def free(self) -> FreeBodies | None:
        """The bodies that the fluid moves, if there are any, where they are now."""
        return None if self.bodies is None else self.bodies.free

    def at(self, time: Float[Array, ""], free: BodyState | None = None) -> Walls:
        """The walls at a time [s], and their free bodies in a state: their bodies' ghosts moved,
        and their velocities."""
        return self if self.bodies is None else self.moved(self.bodies.at(time, free))

    def moved(self, then: Bodies) -> Walls:
        """The walls with their bodies elsewhere."""
        position = self.position + then.of_ghosts(then.offset - self.bodies.offset)
        normal = self.normal
        velocity = self.velocity + then.of_ghosts(then.velocity - self.bodies.velocity)
        if then.free is not None:
            velocity = velocity - self.bodies.free.ghost_velocity(position, normal)
            position, normal = self.bodies.free.carried(then.free, position, normal)
            velocity = velocity + then.free.ghost_velocity(position, normal)
        return Walls(position, normal, velocity, self.fluid_region, then, self.parts)

    def signed_distance(self, position: Float[Array, "points dim"]) -> Float[Array, " points"]:
        """Distance [m] to the nearest wall, negative in the fluid; see `Region`."""
        distance = distance_in(self.fluid_region, position)
        if self.bodies is None:
            return distance
        return jnp.maximum(distance, -self.bodies.signed_distance(position))

    def signed_distance_without(
        self, number: int, position: Float[Array, "points dim"]
    ) -> Float[Array, " points"]:
        """The same for all walls but the free body of that number."""
        distance, bodies = distance_in(self.fluid_region, position), self.bodies
        others = [k for k in range(len(bodies.free.parts)) if k != number]
        for other in others:
            distance = jnp.maximum(distance, -bodies.free.of_body(other, position))
        if bodies.parts:
            moved = dataclasses.replace(bodies, free=None)
            distance = jnp.maximum(distance, -moved.signed_distance(position))
        return distance

    def beyond(self, position: Float[Array, "particles dim"]) -> Bool[Array, " particles"]:
        """Which particles are inside a wall."""
        return self.signed_distance(position) > 0.0

    def put_inside(
        self, position: Float[Array, "particles dim"], margin: float
    ) -> Float[Array, "particles dim"]:
        """Positions [m], those nearer than `margin` [m] to a wall or beyond it put back that far.

        Each is moved along the signed distance's gradient, in turn for each wall of a corner.
        """
        for _ in range(position.shape[1] + 1):  # out of the corner, then off each of its walls
            position = _put_off(self.fluid_region, position, margin)
        return position


def ghosts_in(
    regions: Sequence[Region], ghosts: Float[np.ndarray, "ghosts dim"], spacing: float
) -> list[Bool[np.ndarray, " ghosts"]]:
    """Which ghosts lie in each of some regions, those on its surface among them, as there are where
    a wall crosses places of the lattice; one on the surfaces of several is in the first of them,
    and in all whose inside it is in."""
    found, taken = [], np.zeros(len(ghosts), bool)
    for region in regions:
        distance = distances(region, ghosts)
        on_surface = (np.abs(distance) < _ON_SURFACE * spacing) & ~taken
        taken |= on_surface
        found.append((distance <= -_ON_SURFACE * spacing) | on_surface)
    return found


def _check_parts(parts: Sequence[WallPart], ghosts: np.ndarray, spacing: float) -> None:
    """A ValueError for two parts of one name, or one without a ghost."""
    names = [part.name for part in parts]
    held = ghosts_in([part.region for part in parts], ghosts, spacing)
    for part, own in zip(parts, held, strict=True):
        if names.count(part.name) > 1:
            raise ValueError(f"parts: two have the name {part.name!r}; give each its own.")
        if not own.any():
            raise ValueError(
                f"part {part.name}: no ghost lies in {part.region}; let it cover some of the wall, "
                "several spacings thick, beyond the fluid."
            )


def _without(region: Region, bodies: Sequence[MovingBody]) -> Region:
    for body in bodies:
        region = region & ~body.region
    return region


def _normals(fluid_region: Region, ghosts: np.ndarray, spacing: float) -> np.ndarray:
    """Unit normals towards the fluid; where two faces are as near, one of theirs."""
    normal = -slopes(fluid_region, ghosts)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    flat = length[:, 0] <= _FLAT
    if flat.any():  # on the ridge between the two: half a spacing beside it
        beside = 0.5 * spacing * np.stack(list(product((-1.0, 1.0), repeat=ghosts.shape[1])))
        points = ghosts[flat][:, None] + beside[None]
        found = -slopes(fluid_region, points.reshape(-1, ghosts.shape[1])).reshape(points.shape)
        steepest = np.argmax(np.linalg.norm(found, axis=2), axis=1)
        normal[flat] = found[np.arange(len(found)), steepest]
        length = np.linalg.norm(normal, axis=1, keepdims=True)
    if not np.all(length > _FLAT):
        where = ghosts[int(np.argmin(length))]
        raise ValueError(
            f"walls: the signed distance has no slope at {place(where)}; its gradient must point "
            "away from the fluid everywhere in the wall. That of a file needs a spacing of half "
            "the particles' at most."
        )
    return normal / length


def _body_ghosts(fluid_region: Region, bodies: Sequence[MovingBody], space: Space, thickness):
    """Places at t = 0, normals and owners of the ghosts of bodies in a region of fluid."""
    lattice = space.lattice()
    lattice = lattice[distances(fluid_region, lattice) < 0.0]
    fixed = partial(distances, fluid_region)
    wet = partial(distances, _without(fluid_region, bodies))
    found, taken = [], np.zeros(len(lattice), bool)
    for number, body in enumerate(bodies):
        depth = -distances(body.region, lattice)
        held = (depth >= 0.0) & (depth < thickness) & ~taken
        taken |= depth >= 0.0
        ghosts = lattice[held]
        if not len(ghosts):
            raise ValueError(
                f"moving body: no ghost lies in {body.region}; it must be in the region of fluid, "
                "and several spacings thick."
            )
        normal = _normals(~body.region, ghosts, space.spacing)
        surface = ghosts + depth[held][:, None] * normal
        refuse_thin_walls(wet, space, surface, normal)
        behind = np.asarray(space.box.wrap(jnp.asarray(surface - space.support * normal)))
        shallow = (wet(surface + 0.5 * space.spacing * normal) < 0.0) & (fixed(behind) > 0.0)
        if shallow.any():
            raise ValueError(
                f"moving body: at {place(surface[int(np.argmax(shallow))])} a fixed wall is nearer "
                f"behind its face than the kernel's support of {space.support:.3g} m; the fluid "
                "would feel that wall. Make the body thicker or raise the resolution."
            )
        found.append((ghosts, normal, np.full(len(ghosts), number)))
    return (np.concatenate(a) for a in zip(*found, strict=True))


def fill(
    region: Region,
    lattice: Float[Array, "points dim"],
    position: Float[Array, "points dim"] | None = None,
) -> Float[Array, "particles dim"]:
    """Those places of a lattice that lie in a region of fluid.

    Args:
        region: of fluid.
        lattice: places [m].
        position: of a particle for each place [m], to be taken instead; one that has been moved
            into a wall is not left out but refused by its scene.

    Raises:
        ValueError: if there is none, or there are not as many positions as places.
    """
    position = lattice if position is None else position
    if position.shape != lattice.shape:
        raise ValueError(
            f"arrangement: gives {position.shape[0]} particles for a box with {lattice.shape[0]} "
            "places; give one for each."
        )
    inside = distances(region, np.asarray(lattice)) < 0.0
    if not inside.any():
        raise ValueError(
            "fluid: no particle lies in the region; raise the resolution or check the region."
        )
    return jnp.take(position, np.flatnonzero(inside), axis=0)


@partial(jax.jit, static_argnums=0, inline=True)
def _put_off(region: Region, position, margin: float):
    excess = jnp.maximum(region.signed_distance(position) + margin, 0.0)
    outward = slope_in(region, position)
    squared = jnp.sum(outward * outward, axis=1)
    near = (excess > 0.0) & (squared > 0.0)
    move = jnp.where(near, excess / jnp.where(near, squared, 1.0), 0.0)
    return position - jnp.where(near[:, None], move[:, None] * outward, 0.0)
