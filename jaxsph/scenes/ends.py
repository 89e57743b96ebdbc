"""How a box ends that is flowed through: by a fringe, or by openings."""

from __future__ import annotations

import abc
import dataclasses
import math
from dataclasses import dataclass
from typing import final

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float

from ..arrangements import Lattice
from ..domain import Box
from ..effects import Fringe, Opening, Openings
from ..parking import Parking
from ..walls import BoxRegion, Region
from ..walls.walls import fill
from .scene import Scene

_RATE = 0.3  # of a fringe or a buffer, times h / c0: half of what the longest step stands
_RETURN = 3.0  # of an outlet's pressure, times c0 over the length of the flow
_FRONT, _RESERVE = 1.4, 1.5  # times the kernel's support, from a mouth on and behind that


class Ends(abc.ABC):
    """What lies beyond x = 0 and x = `length` of a flow along the first axis."""

    @abc.abstractmethod
    def box(
        self, length: float, across: tuple[float, float], periodic: bool, dx: float, support: float
    ) -> Box:
        """The box, ends and all, of whole spacings `dx` [m] along the flow."""

    @abc.abstractmethod
    def opening(self, length: float) -> Region | None:
        """Where the fluid may reach past the box's faces."""

    @abc.abstractmethod
    def held(self, x: Float[np.ndarray, " n"], length: float) -> Bool[np.ndarray, " n"]:
        """Where along the flow [m] the inflow's velocity is held."""

    @abc.abstractmethod
    def close(self, scene: Scene, length: float, inflow: eqx.Module, region: Region) -> Scene:
        """A scene in that box with its ends: their effect, and where their particles start."""


def named_ends(name: str, fringe: float) -> Ends:
    """The ends of a name: `fringe`, so long at least [m], or `openings`.

    Raises:
        ValueError: if there are none of that name.
    """
    known = {"fringe": FringeEnds(fringe), "openings": OpenEnds()}
    if name not in known:
        raise ValueError(f"ends: one of {', '.join(known)}, got {name!r}.")
    return known[name]


def buffer_lengths(support: float, dx: float) -> tuple[float, float]:
    """Lengths [m] of an opening's buffer in front of its reserve, and of that."""
    front, reserve = (_rows(share * support, dx) for share in (_FRONT, _RESERVE))
    return front, reserve


def buffer_rate(scene: Scene):
    """At which a fringe or a buffer takes a velocity to its own [1/s]."""
    return jnp.asarray(_RATE * float(scene.fluid.sound_speed) / scene.space.smoothing_length)


def _rows(length: float, dx: float) -> float:
    """A length [m], up to a whole number of spacings."""
    return dx * math.ceil(length / dx - 1e-9)


@final
@dataclass(frozen=True)
class FringeEnds(Ends):
    """A `Fringe` that makes of what flows out what flows in.

    Args:
        fringe: its least length [m]; it ends where a row of particles does.
    """

    fringe: float

    def box(self, length, across, periodic, dx, support):
        return Box((0.0, across[0]), (_rows(length + self.fringe, dx), across[1]), (True, periodic))

    def opening(self, length):
        return None

    def held(self, x, length):
        return x > length

    def close(self, scene, length, inflow, region):
        box = scene.space.box
        held = Fringe(inflow, buffer_rate(scene), length, box.upper[0])
        halfway = 0.5 * (held.start + held.end)
        _check_even(region, halfway, held.end, scene, f"the fringe, {held.start:g} m")
        return dataclasses.replace(scene, effects=(*scene.effects, held))


@final
@dataclass(frozen=True)
class OpenEnds(Ends):
    """`Openings`: an inlet of a given velocity, an outlet of a given pressure.

    Args:
        pressure: at the outlet [Pa].
        spare: particles that are parked at the start, as a share of those in the flow.

    Raises:
        ValueError: for a share below zero.
    """

    pressure: float = 0.0
    spare: float = 0.1

    def __post_init__(self):
        if not 0.0 <= self.spare < np.inf:
            raise ValueError(f"spare: a share of at least 0, got {self.spare:g}.")

    def box(self, length, across, periodic, dx, support):
        behind = sum(buffer_lengths(support, dx))
        upper = _rows(length, dx) + behind
        return Box((-behind, across[0]), (upper, across[1]), (False, periodic))

    def opening(self, length):
        past = np.inf
        return BoxRegion((-past, -past), (0.0, past)) | BoxRegion((length, -past), (past, past))

    def held(self, x, length):
        return x < 0.0

    def close(self, scene, length, inflow, region):
        space, box, state = scene.space, scene.space.box, scene.state
        mouth = box.upper[0] + box.lower[0]
        _check_even(region, box.lower[0], 0.0, scene, f"the inlet's buffer, {box.lower[0]:g} m")
        _check_even(region, mouth, box.upper[0], scene, f"the outlet's buffer, {mouth:g} m")
        _, reserve = buffer_lengths(space.support, space.spacing)
        sizes = {"axis": 0, "reserve": reserve, "cell": space.spacing}
        sizes["periodic"] = (1,) if box.periodic[1] else ()
        inlet = Opening(inflow, None, None, box.lower, (0.0, box.upper[1]), inward=1.0, **sizes)
        corners = (mouth, box.lower[1]), box.upper
        returning = _RETURN * scene.fluid.sound_speed / length
        outlet = Opening(
            None, jnp.asarray(self.pressure), returning, *corners, inward=-1.0, **sizes
        )
        ends = Openings((inlet, outlet), buffer_rate(scene), Parking(box))
        return put_at_openings(scene, ends, region, self.spare * len(state.position))


def put_at_openings(scene: Scene, ends: Openings, region: Region, spare: float) -> Scene:
    """A scene with openings: rows of particles in their buffers, and so many parked."""
    state, place = scene.state, jnp.asarray(ends.parking.place, scene.state.position.dtype)
    rows = fill(region, Lattice().places(scene.space)).astype(place.dtype)
    buffered = [opening.spans(rows) & (opening.depth(rows) > 0.0) for opening in ends.openings]
    position = jnp.where(jnp.any(jnp.stack(buffered), axis=0)[:, None], rows, state.position)
    parked = jnp.broadcast_to(place, (math.ceil(spare), *place.shape))
    at_rest = jnp.broadcast_to(scene.fluid.reference_density, len(parked))
    state = dataclasses.replace(
        state,
        position=jnp.concatenate([position, parked]),
        velocity=jnp.concatenate([state.velocity, jnp.zeros_like(parked)]),
        density=jnp.concatenate([state.density, at_rest]),
    )
    return dataclasses.replace(scene, effects=(*scene.effects, ends), state=state)


def _check_even(region: Region, start: float, end: float, scene: Scene, where: str) -> None:
    """A ValueError if walls change between two places along the flow [m]."""
    box, spacing = scene.space.box, scene.space.spacing
    columns = max(1, int((end - start) / spacing + 1e-9))
    x = end - spacing * (0.5 + np.arange(columns)[::-1])
    y = np.arange(box.lower[1] + 0.5 * spacing, box.upper[1], spacing)
    places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=2)
    distance = np.asarray(region.signed_distance(jnp.asarray(places.reshape(-1, 2))))
    fluid = (distance < 0.0).reshape(places.shape[:2])
    changes = np.flatnonzero((fluid != fluid[-1]).any(axis=1))
    if len(changes):
        raise ValueError(
            f"region: its walls change at x = {x[changes[0]]:.4g} m, along {where} to {end:g} m, "
            "where velocities are held; let bodies lie in the flow, and walls go on straight."
        )
