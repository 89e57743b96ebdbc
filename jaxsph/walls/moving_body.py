"""Bodies of wall that are moved through the fluid: pistons, gates, cylinders; and all bodies."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import reduce
from typing import final

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from ..body_state import BodyState
from ..content.parts import WHERE_SET
from ..domain import Box
from .free_body import FreeBodies
from .region import Region

_START = 1e-9  # m: a displacement at t = 0 that is round-off


@final
class MovingBody(eqx.Module):
    """A part of the walls that is moved as a whole, without turning, as a function of time.

    At time t it fills {x + d(t): x in its region}; velocity d'(t) and acceleration d''(t) are
    forward derivatives of d, so that these fit it whatever it is. Where `displacement` is an
    `eqx.Module`, its arrays (an amplitude, a frequency) may be swept and differentiated.

    Args:
        region: of the body at t = 0 (static).
        displacement: time [s] -> d (n,) [m], with `jax.numpy`, zero at t = 0; twice differentiable,
            or the fluid feels its kinks.

    Examples:
        >>> import jax.numpy as jnp
        >>> from jaxsph import BoxRegion, MovingBody
        >>> fast = MovingBody(BoxRegion((0.0, 0.0), (1.0, 1.0)), lambda t: jnp.stack([t**2, 0 * t]))
        >>> [float(x[0]) for x in fast.motion(jnp.asarray(3.0))]  # way, velocity, acceleration
        [9.0, 6.0, 2.0]
    """

    region: Region = eqx.field(static=True)
    displacement: Callable[[Array], Array]

    def motion(
        self, time: Float[Array, ""]
    ) -> tuple[Float[Array, " dim"], Float[Array, " dim"], Float[Array, " dim"]]:
        """d [m], d' [m/s] and d'' [m/s^2] at a time [s]."""
        one = jnp.ones_like(time)

        def way_and_velocity(t):
            return jax.jvp(self.displacement, (t,), (one,))

        (way, velocity), (_, acceleration) = jax.jvp(way_and_velocity, (time,), (one,))
        return tuple(each.astype(time.dtype) for each in (way, velocity, acceleration))


@final
class Bodies(eqx.Module):
    """All moving bodies of a scene, where they are at one time.

    Args:
        parts: the bodies whose way is given, B in number.
        owner: the number of each ghost's body; B for a ghost of a fixed wall.
        offset: d of each body [m].
        velocity: d' of each body [m/s].
        acceleration: d'' of each body [m/s^2].
        box: of the scene (static).
        free: those that the fluid moves, if there are any.
    """

    parts: tuple[MovingBody, ...]
    owner: Int[Array, " ghosts"]
    offset: Float[Array, "bodies dim"]
    velocity: Float[Array, "bodies dim"]
    acceleration: Float[Array, "bodies dim"]
    box: Box = eqx.field(static=True)
    free: FreeBodies | None = eqx.field(default=None, metadata=WHERE_SET)

    @classmethod
    def at_start(
        cls,
        parts: Sequence[MovingBody],
        owner: Int[Array, " ghosts"],
        box: Box,
        free: FreeBodies | None = None,
    ) -> Bodies:
        """The bodies at t = 0.

        Raises:
            ValueError: for a displacement of another shape than (n,), or not zero at t = 0.
        """
        for body in parts:
            start = jnp.asarray(body.displacement(jnp.zeros(())))
            if start.shape != (box.dim,):
                raise ValueError(
                    f"moving body: the displacement of {body.region} has shape {start.shape}; let "
                    f"it give an array of the {box.dim} components of a way in m."
                )
            if not bool(jnp.all(jnp.abs(start) <= _START)):
                raise ValueError(
                    f"moving body: the displacement of {body.region} is {start} m at t = 0; let it "
                    "start from zero, and the region be where the body is then."
                )
        motion = _motions(parts, jnp.zeros(()), box.dim)
        return cls(tuple(parts), owner, *motion, box, free)

    def at(self, time: Float[Array, ""], free: BodyState | None = None) -> Bodies:
        """The same bodies at another time [s], and the free ones in another state."""
        motion = _motions(self.parts, time, self.box.dim)
        moved = self.free if free is None or self.free is None else self.free.at(free)
        return Bodies(self.parts, self.owner, *motion, self.box, moved)

    def of_ghosts(self, values: Float[Array, "bodies dim"]) -> Float[Array, "ghosts dim"]:
        """Each ghost's value of its body, zero for ghosts of fixed walls and of free bodies."""
        like = values if self.parts else jnp.zeros((1, self.box.dim), values.dtype)
        none = jnp.zeros_like(like[:1])
        return jnp.concatenate([values, none])[self.owner]

    def ghost_acceleration(
        self, position: Float[Array, "ghosts dim"], normal: Float[Array, "ghosts dim"]
    ) -> Float[Array, "ghosts dim"]:
        """Of each ghost with its body [m/s^2], zero for fixed walls.

        Args:
            position, normal: of all ghosts, where the bodies are.
        """
        given = self.of_ghosts(self.acceleration)
        if self.free is None:
            return given
        return given + self.free.ghost_acceleration(position, normal)

    def signed_distance(self, position: Float[Array, "points dim"]) -> Float[Array, " points"]:
        """Distance [m] to the nearest body, negative inside one."""
        distances = [
            body.region.signed_distance(self.box.wrap(position - self.offset[None, k]))
            for k, body in enumerate(self.parts)
        ]
        if self.free is not None:
            distances.append(self.free.signed_distance(position))
        return reduce(jnp.minimum, distances)

    @property
    def speed(self) -> Float[Array, ""]:
        """Of the fastest body [m/s]."""
        if not self.parts:
            return self.free.speed
        squared = jnp.max(jnp.sum(self.velocity * self.velocity, axis=1))
        moving = squared > 0.0  # the root has no slope at rest
        speed = jnp.where(moving, jnp.sqrt(jnp.where(moving, squared, 1.0)), 0.0)
        return speed if self.free is None else jnp.maximum(speed, self.free.speed)


def _motions(parts: Sequence[MovingBody], time, dim: int):
    """d, d' and d'' of all, each (B, n)."""
    if not parts:
        return (jnp.zeros((0, dim), time.dtype),) * 3
    motions = [body.motion(time) for body in parts]
    return tuple(jnp.stack([motion[k] for motion in motions]) for k in range(3))
