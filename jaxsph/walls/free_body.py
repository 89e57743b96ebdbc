"""Bodies that are moved by the fluid: ships, boxes, cylinders that float or sink."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from typing import final

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..body_state import BodyState
from ..domain import Box
from ..pairs import Space
from .region import Region

_PARTS = 8  # of a lattice cell's side, for the moments of a region


@final
class FreeBody(eqx.Module):
    """A rigid body in two dimensions that the fluid and the body forces move and turn:

        M dv/dt = F + M b,    I dw/dt = T,    dx_c/dt = v,    d(angle)/dt = w,

    F and T the force of the fluid and its torque about the centre of mass x_c, the very sums that
    act on the fluid; b the body forces at x_c.

    Args:
        region: of the body at the start (static).
        mass: M [kg], of a metre's depth.
        inertia: I about the centre of mass [kg m^2], of a metre's depth.
        center: of mass, at the start (2,) [m].
        velocity: of it at the start (2,) [m/s]; at rest if none is given.
        spin: at the start [rad/s].

    Raises:
        ValueError: for a mass or a moment of inertia that is not positive, or shapes of another
            number of dimensions than two.

    Examples:
        >>> import jax.numpy as jnp
        >>> from jaxsph import Box, BoxRegion, FreeBody, Space
        >>> from jaxsph.kernels import WendlandC2
        >>> space = Space(Box((0.0, 0.0), (2.0, 2.0), (False, False)), WendlandC2(), 0.2, 0.1)
        >>> box = FreeBody.of_density(BoxRegion((0.5, 0.5), (1.5, 1.3)), 500.0, space)
        >>> round(float(box.mass)), [round(float(x), 6) for x in box.center]
        (400, [1.0, 0.9])
    """

    region: Region = eqx.field(static=True)
    mass: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    inertia: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    center: Float[Array, " dim"] = eqx.field(converter=jnp.asarray)
    velocity: Float[Array, " dim"] = eqx.field(converter=jnp.asarray, default=(0.0, 0.0))
    spin: Float[Array, ""] = eqx.field(converter=jnp.asarray, default=0.0)

    @classmethod
    def of_density(
        cls,
        region: Region,
        density: float,
        space: Space,
        velocity: Sequence[float] = (0.0, 0.0),
        spin: float = 0.0,
    ) -> FreeBody:
        """A body of uniform density [kg/m^3], its mass, centre and moment of inertia summed over
        the space's lattice, each cell in 8 x 8 parts.

        Raises:
            ValueError: for a density that is not positive, a region that is not within the box, or
                one in another number of dimensions than two.
        """
        if not density > 0.0:
            raise ValueError(f"free body: its density must be positive, got {density:g} kg/m^3.")
        _two_dimensions(space.box.dim)
        area, center, second = _moments(region, space)
        return cls(region, density * area, density * second, center, tuple(velocity), spin)


def checked(body: FreeBody, box: Box) -> None:
    """A ValueError for a body that cannot be one of a box."""
    _two_dimensions(box.dim)
    for name in ("mass", "inertia"):
        value = float(getattr(body, name))
        if not value > 0.0:
            raise ValueError(
                f"free body: the {name} of {body.region} must be positive, got {value:g}; "
                "FreeBody.of_density sums it for a density."
            )
    for name in ("center", "velocity"):
        shape = getattr(body, name).shape
        if shape != (2,):
            raise ValueError(
                f"free body: the {name} of {body.region} has shape {shape}; give its two "
                "components."
            )


@final
class FreeBodies(eqx.Module):
    """All free bodies of a scene, where they are at one time.

    Args:
        parts: the bodies, F in number.
        owner: the number of each ghost's body; F for a ghost of another wall.
        depth: of each ghost behind its body's surface [m].
        state: where they are and how they move.
        reach: of each body's surface from its centre [m].
        layer: dx sum n n^T dA over each body's surface (F, 3, 3), n = (n_x, n_y, (x - x_c) x n):
            times rho0, the mass and moment of inertia of a layer of fluid one spacing thick.
        box: of the scene (static).
    """

    parts: tuple[FreeBody, ...]
    owner: Int[Array, " ghosts"]
    depth: Float[Array, " ghosts"]
    state: BodyState
    reach: Float[Array, " bodies"]
    layer: Float[Array, "bodies 3 3"]
    box: Box = eqx.field(static=True)

    @classmethod
    def at_start(
        cls,
        parts: Sequence[FreeBody],
        owner: Int[Array, " ghosts"],
        position: Float[Array, "ghosts dim"],
        normal: Float[Array, "ghosts dim"],
        space: Space,
    ) -> FreeBodies:
        """The bodies at the start, their ghosts at given places [m] and with given normals."""
        center, velocity = (
            jnp.stack([getattr(body, name) for body in parts]) for name in ("center", "velocity")
        )
        spin = jnp.stack([body.spin for body in parts])
        state = BodyState(center, jnp.zeros_like(spin), velocity, spin)
        depth, reach = np.zeros(len(position)), np.zeros(len(parts))
        layer, dx = np.zeros((len(parts), 3, 3)), space.spacing
        for number, body in enumerate(parts):
            own = np.asarray(owner) == number
            distance = np.asarray(body.region.signed_distance(position[own]))
            depth[own] = np.maximum(-distance, 0.0)  # one on the surface may be round-off before it
            way = np.asarray(position[own]) - np.asarray(body.center)
            reach[number] = (np.linalg.norm(way, axis=1) + depth[own]).max()
            n = np.asarray(normal[own])
            n = np.concatenate([n, (way[:, :1] * n[:, 1:] - way[:, 1:] * n[:, :1])], axis=1)
            n = n[depth[own] < dx]  # of which each stands for a spacing of the surface
            layer[number] = dx**2 * n.T @ n
        found = (jnp.asarray(each) for each in (reach, layer))
        return cls(tuple(parts), owner, jnp.asarray(depth), state, *found, space.box)

    def at(self, state: BodyState) -> FreeBodies:
        """The same bodies elsewhere."""
        return eqx.tree_at(lambda bodies: bodies.state, self, state)

    def carried(
        self,
        then: FreeBodies,
        position: Float[Array, "ghosts dim"],
        normal: Float[Array, "ghosts dim"],
    ) -> tuple[Float[Array, "ghosts dim"], Float[Array, "ghosts dim"]]:
        """Places [m] and normals of ghosts, those of free bodies taken along to where these are
        then."""
        angle = self._of_ghosts(then.state.angle - self.state.angle)
        here = self._of_ghosts(self.state.position)
        moved = here + self._of_ghosts(then.state.position - self.state.position)
        arm = turned(angle, position - here)
        own = (self.owner < len(self.parts))[:, None]
        return jnp.where(own, moved + arm, position), jnp.where(own, turned(angle, normal), normal)

    def ghost_velocity(
        self, position: Float[Array, "ghosts dim"], normal: Float[Array, "ghosts dim"]
    ) -> Float[Array, "ghosts dim"]:
        """v + w x (x - x_c) at the surface before each ghost [m/s]; zero for other walls' ghosts.

        Args:
            position, normal: of all ghosts, where the bodies are.
        """
        arm = self._arm(position, normal)
        spin = self._of_ghosts(self.state.spin)
        return self._of_ghosts(self.state.velocity) + spin[:, None] * quarter(arm)

    def ghost_acceleration(
        self, position: Float[Array, "ghosts dim"], normal: Float[Array, "ghosts dim"]
    ) -> Float[Array, "ghosts dim"]:
        """-w^2 (x - x_c) at the surface before each ghost [m/s^2], zero for other walls' ghosts;
        what the fluid gives the body is not known before the ghosts' pressure is."""
        spin = self._of_ghosts(self.state.spin)[:, None]
        return -spin * spin * self._arm(position, normal)

    def surface(
        self, position: Float[Array, "ghosts dim"], normal: Float[Array, "ghosts dim"]
    ) -> Float[Array, "ghosts dim"]:
        """Places on the surface before each ghost of a free body [m]; a ghost of another wall
        stays where it is."""
        return position + self.depth[:, None] * normal

    def signed_distance(self, position: Float[Array, "points dim"]) -> Float[Array, " points"]:
        """Distance [m] to the nearest body, negative inside one."""
        return reduce(jnp.minimum, [self.of_body(k, position) for k in range(len(self.parts))])

    def of_body(
        self, number: int, position: Float[Array, "points dim"]
    ) -> Float[Array, " points"]:
        """The same of one body."""
        body, state = self.parts[number], self.state
        center = jnp.broadcast_to(state.position[number][None], position.shape)
        arm = self.box.displacement(center, position)
        start = body.center[None] + turned(-state.angle[number], arm)
        return body.region.signed_distance(start)

    @property
    def speed(self) -> Float[Array, ""]:
        """At most of any point of a body [m/s]."""
        squared = jnp.sum(self.state.velocity**2, axis=1)
        moving = squared > 0.0  # the root has no slope at rest
        speed = jnp.where(moving, jnp.sqrt(jnp.where(moving, squared, 1.0)), 0.0)
        return jnp.max(speed + jnp.abs(self.state.spin) * self.reach)

    def step_share(self, density: Float[Array, ""]) -> Float[Array, ""]:
        """(1 + L)^(-1/2), the share of the acoustic step at which the lightest body is stable: L is
        the largest row sum of the matrix of `layer`, times rho0 and by the body's own inertia.

        A body of mass M that rests on a layer of particles of mass m oscillates with it as one on
        a spring, at (1 + m / M)^(1/2) times the layer's own frequency.

        Args:
            density: rho0 [kg/m^3].
        """
        inert = jnp.stack([jnp.stack([b.mass, b.mass, b.inertia]) for b in self.parts])
        root = jnp.sqrt(inert)
        relative = density * self.layer / (root[:, :, None] * root[:, None, :])
        return (1.0 + jnp.max(jnp.sum(jnp.abs(relative), axis=2))) ** -0.5

    def _arm(self, position, normal):
        return self.surface(position, normal) - self._of_ghosts(self.state.position)

    def _of_ghosts(self, values: Array) -> Array:
        """Each ghost's value of its body, zero for others."""
        zero = jnp.zeros((1, *values.shape[1:]), values.dtype)
        return jnp.concatenate([values, zero])[self.owner]


def turned(angle: Array, vector: Float[Array, "points 2"]) -> Float[Array, "points 2"]:
    """Vectors turned by an angle [rad], one for all or one for each."""
    cosine, sine = jnp.cos(angle), jnp.sin(angle)
    x, y = vector[:, 0], vector[:, 1]
    return jnp.stack([cosine * x - sine * y, sine * x + cosine * y], axis=1)


def quarter(vector: Float[Array, "points 2"]) -> Float[Array, "points 2"]:
    """Vectors turned by a quarter: e_z x v."""
    return jnp.stack([-vector[:, 1], vector[:, 0]], axis=1)


def _two_dimensions(dim: int) -> None:
    if dim != 2:
        raise ValueError(
            f"free body: bodies that the fluid moves are known in two dimensions, got {dim}; let "
            "the body be a MovingBody, whose way is given."
        )


def _moments(region: Region, space: Space) -> tuple[float, np.ndarray, float]:
    """Area [m^2], centre [m] and polar moment about it [m^4] of a region within the box."""

    def distances(points):
        return np.asarray(region.signed_distance(jnp.asarray(points)))

    steps = np.asarray(space.steps)
    offset = (np.arange(_PARTS) + 0.5) / _PARTS - 0.5
    offsets = np.stack(np.meshgrid(offset, offset, indexing="ij"), axis=-1).reshape(-1, 2) * steps
    cells = space.lattice()
    cells = cells[distances(cells) < np.hypot(*steps)]
    points = (cells[:, None] + offsets[None]).reshape(-1, 2)
    cell = space.cell_volume / len(offsets)
    share = np.clip(0.5 - distances(points) * _PARTS / steps.min(), 0.0, 1.0)
    area = float(share.sum() * cell)
    if not area > 0.0:
        raise ValueError(f"free body: {region} holds no place of the box; let it lie within.")
    center = (share[:, None] * points).sum(axis=0) * cell / area
    own = (steps**2).sum() / _PARTS**2 / 12.0  # of a part about its own centre
    second = float((share * (((points - center) ** 2).sum(axis=1) + own)).sum() * cell)
    return area, center, second
