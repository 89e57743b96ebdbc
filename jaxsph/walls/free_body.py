"""Bodies that are moved by the fluid: ships, boxes, cylinders that float or sink."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from typing import Any, final

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..body_state import BodyState
from ..domain import Box
from ..pairs import Space
from ..wall_surface import moment
from .distances import Cells, distances
from .region import Region
from .rotation import across, inverse, turned, turned_on

_UNEVEN = 1e-6  # of the largest moment of inertia: what its matrix may lack in symmetry


def _real(value: Any) -> Array:
    """As an array, of floating numbers."""
    value = jnp.asarray(value)
    return value if jnp.issubdtype(value.dtype, jnp.inexact) else value.astype(float)


@final
class FreeBody(eqx.Module):
    """A rigid body that the fluid and the body forces move and turn:

        M dv/dt = F + M b,    d(I w)/dt = T,    dx_c/dt = v,

    F and T the force of the fluid and its torque about the centre of mass x_c, the very sums that
    act on the fluid; b the body forces at x_c. In two dimensions d(angle)/dt = w, in three I turns
    with the body and the angle is a rotation vector (`jaxsph.BodyState`).

    Args:
        region: of the body at the start (static).
        mass: M [kg], of a metre's depth in two dimensions.
        inertia: I about the centre of mass at the start [kg m^2]: a number in two dimensions, of a
            metre's depth, and a matrix (3, 3) in three.
        center: of mass, at the start (n,) [m].
        velocity: of it at the start (n,) [m/s]; at rest if none is given.
        spin: w at the start [rad/s], about x_c, (3,) in three dimensions; none if none is given.

    Raises:
        ValueError: for a mass or a moment of inertia that is not positive, or of another number of
            dimensions than the box.

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
    mass: Float[Array, ""] = eqx.field(converter=_real)
    inertia: Float[Array, ""] = eqx.field(converter=_real)
    center: Float[Array, " dim"] = eqx.field(converter=_real)
    velocity: Float[Array, " dim"] = eqx.field(converter=_real)
    spin: Float[Array, "..."] = eqx.field(converter=_real)

    def __init__(self, region, mass, inertia, center, velocity=None, spin=None):
        self.region, self.mass, self.inertia, self.center = region, mass, inertia, center
        self.velocity = jnp.zeros(np.shape(center)) if velocity is None else velocity
        self.spin = jnp.zeros(np.shape(inertia)[:-1]) if spin is None else spin

    @classmethod
    def of_density(
        cls,
        region: Region,
        density: float,
        space: Space,
        velocity: Sequence[float] | None = None,
        spin: float | Sequence[float] | None = None,
    ) -> FreeBody:
        """A body of uniform density [kg/m^3], its mass, centre and moment of inertia summed over
        the space's lattice, cells at the surface in parts: 8 along each axis, 4 in space.

        Raises:
            ValueError: for a density that is not positive, or a region that is not within the box,
                between periodic faces as well.
        """
        if not density > 0.0:
            raise ValueError(f"free body: its density must be positive, got {density:g} kg/m^3.")
        _refuse_crossing(region, space)
        volume, center, second = _moments(region, space)
        inertia = np.trace(second)
        if space.box.dim == 3:
            inertia = inertia * np.eye(3) - second
        return cls(region, density * volume, density * inertia, center, velocity, spin)


def checked(body: FreeBody, box: Box) -> None:
    """A ValueError for a body that cannot be one of a box."""
    flat = box.dim == 2
    shapes = {"mass": (), "inertia": () if flat else (3, 3), "center": (box.dim,),
              "velocity": (box.dim,), "spin": () if flat else (3,)}  # fmt: skip
    for name, expected in shapes.items():
        shape = getattr(body, name).shape
        if shape != expected:
            raise ValueError(
                f"free body: the {name} of {body.region} has shape {shape}, and in {box.dim} "
                f"dimensions it is {expected}."
            )
    inertia = np.atleast_2d(np.asarray(body.inertia))
    if np.abs(inertia - inertia.T).max() > _UNEVEN * np.abs(inertia).max():
        raise ValueError(
            f"free body: the inertia of {body.region} is no symmetric matrix; FreeBody.of_density "
            "sums it for a density."
        )
    moments = np.linalg.eigvalsh(inertia)
    for name, value in ("mass", float(body.mass)), ("inertia", moments.min()):
        if not value > 0.0:
            raise ValueError(
                f"free body: the {name} of {body.region} must be positive, got {value:g}; "
                "FreeBody.of_density sums it for a density."
            )
    if moments[-1] > (1.0 + _UNEVEN) * moments[:-1].sum() and not flat:
        raise ValueError(
            f"free body: of the moments of inertia of {body.region}, {moments}, one is more than "
            "the sum of the others, which no body has; give r^2 1 - r r^T summed over its mass."
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
        layer: dx sum n n^T dA over each body's surface (F, D, D), n here the normal and after it
            (x - x_c) x n, D = 3 of them in two dimensions and 6 in three: times rho0, the mass and
            moment of inertia of a layer of fluid one spacing thick.
        box: of the scene (static).
    """

    parts: tuple[FreeBody, ...]
    owner: Int[Array, " ghosts"]
    depth: Float[Array, " ghosts"]
    state: BodyState
    reach: Float[Array, " bodies"]
    layer: Float[Array, "bodies freedoms freedoms"]
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
        layer, dx, dim = [], space.spacing, space.box.dim
        for number, body in enumerate(parts):
            own = np.asarray(owner) == number
            distance = np.asarray(body.region.signed_distance(position[own]))
            depth[own] = np.maximum(-distance, 0.0)  # one on the surface may be round-off before it
            way = np.asarray(position[own]) - np.asarray(body.center)
            reach[number] = (np.linalg.norm(way, axis=1) + depth[own]).max()
            n = np.asarray(normal[own])
            n = np.concatenate([n.T, moment(way.T, n.T)])
            n = n[:, depth[own] < dx]  # of which each stands for a spacing of the surface
            layer.append(dx**dim * n @ n.T)
        found = (jnp.asarray(each) for each in (reach, np.stack(layer)))
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
        angles = [self._of_ghosts(each.state.angle) for each in (self, then)]
        here = self._of_ghosts(self.state.position)
        moved = here + self._of_ghosts(then.state.position - self.state.position)
        arm, normal_then = (turned_on(*angles, each) for each in (position - here, normal))
        own = (self.owner < len(self.parts))[:, None]
        return jnp.where(own, moved + arm, position), jnp.where(own, normal_then, normal)

    def ghost_velocity(
        self, position: Float[Array, "ghosts dim"], normal: Float[Array, "ghosts dim"]
    ) -> Float[Array, "ghosts dim"]:
        """v + w x (x - x_c) at the surface before each ghost [m/s]; zero for other walls' ghosts.

        Args:
            position, normal: of all ghosts, where the bodies are.
        """
        spin = self._of_ghosts(self.state.spin)
        return self._of_ghosts(self.state.velocity) + across(spin, self._arm(position, normal))

    def ghost_acceleration(
        self, position: Float[Array, "ghosts dim"], normal: Float[Array, "ghosts dim"]
    ) -> Float[Array, "ghosts dim"]:
        """w x (w x (x - x_c)) at the surface before each ghost [m/s^2], zero for other walls'
        ghosts; what the fluid gives the body is not known before the ghosts' pressure is."""
        spin = self._of_ghosts(self.state.spin)
        return across(spin, across(spin, self._arm(position, normal)))

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
        spin = self.state.spin
        spin = jnp.abs(spin) if spin.ndim == 1 else _size(spin)
        return jnp.max(_size(self.state.velocity) + spin * self.reach)

    def step_share(self, density: Float[Array, ""]) -> Float[Array, ""]:
        """(1 + L)^(-1/2), the share of the acoustic step at which the lightest body is stable: L
        bounds the eigenvalues of M^-1 rho0 `layer`, M the body's own matrix of mass and inertia, by
        the largest sum of a row, in units of which M's diagonal is 1. `layer` is of the ghosts that
        there are, 0.7 to 0.9 of a curved surface a few spacings across.

        A body of mass M that rests on a layer of particles of mass m oscillates with it as one on
        a spring, at (1 + m / M)^(1/2) times the layer's own frequency.

        Args:
            density: rho0 [kg/m^3].
        """
        dim = self.box.dim
        inertia = jnp.stack([jnp.atleast_2d(body.inertia) for body in self.parts])
        mass = jnp.stack([jnp.broadcast_to(body.mass, (dim,)) for body in self.parts])
        root = jnp.concatenate([mass, jnp.diagonal(inertia, axis1=1, axis2=2)], axis=1) ** 0.5
        unit = root[:, :, None] * root[:, None, :]
        relative = density * self.layer / unit
        if dim == 3:  # M is more than its diagonal
            own = inverse(inertia / unit[:, dim:, dim:])
            relative = jnp.concatenate([relative[:, :dim], own @ relative[:, dim:]], axis=1)
        return (1.0 + jnp.max(jnp.sum(jnp.abs(relative), axis=2))) ** -0.5

    def _arm(self, position, normal):
        return self.surface(position, normal) - self._of_ghosts(self.state.position)

    def _of_ghosts(self, values: Array) -> Array:
        """Each ghost's value of its body, zero for others."""
        zero = jnp.zeros((1, *values.shape[1:]), values.dtype)
        return jnp.concatenate([values, zero])[self.owner]


def _size(vector: Float[Array, "bodies dim"]) -> Float[Array, " bodies"]:
    squared = jnp.sum(vector**2, axis=1)
    moving = squared > 0.0  # the root has no slope at rest
    return jnp.where(moving, jnp.sqrt(jnp.where(moving, squared, 1.0)), 0.0)


def _refuse_crossing(region: Region, space: Space) -> None:
    """A ValueError for a region that goes through a face of the box."""
    cells, box = space.lattice(), space.box
    for axis in range(box.dim):
        on_face = cells[cells[:, axis] == cells[0, axis]]
        for face in (box.lower[axis], box.upper[axis]):
            on_face[:, axis] = face
            if (distances(region, on_face) < -_UNEVEN * space.spacing).any():
                raise ValueError(
                    f"free body: {region} goes through the box's face at {'xyz'[axis]} = {face:g} "
                    "m; let it lie within the box at the start, between periodic faces as well."
                )


def _moments(region: Region, space: Space) -> tuple[float, np.ndarray, np.ndarray]:
    """Volume V, centre (n,) and second moments about it, the integrals of r_i r_j dV (n, n), of a
    region within the box; of an area in two dimensions."""
    cells, steps = Cells.of(region, space), np.asarray(space.steps)
    if not cells.count > 0.0:
        raise ValueError(f"free body: {region} holds no place of the box; let it lie within.")
    whole = (cells.whole, np.ones(len(cells.whole)), steps)
    pieces = (whole, (cells.parts, cells.share, steps / cells.divided))
    about = np.concatenate([cells.whole, cells.parts]).mean(axis=0)
    first, second = 0.0, 0.0
    for points, share, side in pieces:
        way, size = points - about, side.prod()
        first = first + size * (share @ way)
        second = second + size * ((share * way.T) @ way + share.sum() * np.diag(side**2) / 12.0)
    volume = cells.count * space.cell_volume
    center = first / volume
    return volume, about + center, second - volume * np.outer(center, center)
