"""Body forces."""

from __future__ import annotations

import abc
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..domain import Box
from .base import Effect
from .wall_pressure import GHOST_MOMENT


class BodyForce(Effect):
    """du_i/dt = b(t, x_i); the pressure of walls balances it as well (`WallPressure`)."""

    def conservative_part(self, box: Box) -> BodyForce | None:
        """What of it has a `potential` in a box, periodic directions considered; None if nothing.

        What drives a flow around a periodic direction has none.
        """
        return None

    def potential(
        self, time: Float[Array, ""], position: Float[Array, "points dim"]
    ) -> Float[Array, " points"]:
        """Phi [m^2/s^2], b = -grad Phi, of a force that is its own conservative part."""
        raise NotImplementedError

    @abc.abstractmethod
    def acceleration(
        self, time: Float[Array, ""], position: Float[Array, "points dim"]
    ) -> Float[Array, "points dim"]:
        """b [m/s^2] at a time [s] and at positions [m]."""

    def ghost_terms(self, context):
        return (GHOST_MOMENT,)

    def rates(self, context, fields, sums):
        return {"velocity": self.acceleration(context.time, fields["position"])}


class Gravity(BodyForce):
    """A uniform, constant body force.

    Args:
        vector: b (n,) [m/s^2].
    """

    vector: Float[Array, " dim"] = eqx.field(converter=jnp.asarray)

    def acceleration(self, time, position):
        return jnp.broadcast_to(self.vector[None, :], position.shape)

    def conservative_part(self, box):
        closed = jnp.asarray([0.0 if p else 1.0 for p in box.periodic], self.vector.dtype)
        return Gravity(self.vector * closed)

    def potential(self, time, position):
        return -jnp.sum(self.vector[None, :] * position, axis=1)


class CentralForce(BodyForce):
    """b = -Omega^2 (x - x_c): a pull towards a centre that grows with the distance.

    Args:
        frequency: Omega [rad/s].
        center: x_c [m] (static).
    """

    frequency: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    center: tuple[float, ...] = eqx.field(static=True)

    def acceleration(self, time, position):
        center = jnp.asarray(self.center, position.dtype)[None, :]
        return self.frequency**2 * (center - position)

    def conservative_part(self, box):
        return None if any(box.periodic) else self

    def potential(self, time, position):
        center = jnp.asarray(self.center, position.dtype)[None, :]
        return 0.5 * self.frequency**2 * jnp.sum((position - center) ** 2, axis=1)


class MovingFrame(BodyForce):
    """b = -d''(t): inertia in the frame of a vessel that is moved as a whole by d(t).

    A shaken tank is then one at rest, whose ghosts stay where they are. d'' is the forward
    derivative of d, so that it fits any d, as for `MovingBody`.

    Args:
        displacement: time [s] -> d (n,) [m], with `jax.numpy`, twice differentiable.
    """

    displacement: Callable[[Array], Array]

    def acceleration(self, time, position):
        second = jax.jacfwd(jax.jacfwd(self.displacement))(time)
        return jnp.broadcast_to(-second[None, :], position.shape).astype(position.dtype)


class KickAndHold(BodyForce):
    """The open cavity's drive along the first axis, inside a box from `lower` to `upper` (paper):

        b_x(t) = b0 [1 / (1 + exp(-k (f0 - t))) + k0].

    As printed (f = -t) it does not ramp up: it kicks with about b0 until t = f0 and falls within
    some 1 / k to b0 k0.

    Args:
        amplitude: b0 [m/s^2].
        steepness: k [1/s].
        duration: f0 [s].
        remainder: k0, the share of b0 that stays.
        lower, upper: corners of the box [m] where it acts (static).
    """

    amplitude: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    steepness: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    duration: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    remainder: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    lower: tuple[float, ...] = eqx.field(static=True)
    upper: tuple[float, ...] = eqx.field(static=True)

    def acceleration(self, time, position):
        ramp = jax.nn.sigmoid(self.steepness * (self.duration - time))
        strength = self.amplitude * (ramp + self.remainder)
        lower = jnp.asarray(self.lower, position.dtype)[None, :]
        upper = jnp.asarray(self.upper, position.dtype)[None, :]
        inside = jnp.all((position >= lower) & (position <= upper), axis=1)
        force = jnp.zeros_like(position)
        return force.at[:, 0].set(jnp.where(inside, strength, jnp.zeros((), position.dtype)))
