"""A fringe, in which what flows out is made into what flows in."""

from collections.abc import Callable
from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..ramps import ramp
from .base import Effect

_RISE = 0.5  # of the fringe, over which its strength rises
_STABLE = 2.0  # over the rate; RK4 stands 2.78


class Fringe(Effect):
    """du_i/dt = (1 - s_i) a_i + s_i [dU/dt - rate (u_i - U(x_i, t))] between two places along the
    first axis:

    a_i is the sum of all other effects, s rises smoothly from 0 to 1 over the first half of the
    fringe and is 1 up to its end, U is the profile of the inflow. The box is periodic along that
    axis, and the fringe its last part (after Spalart 1988; Nordstrom, Nordin and Henningson 1999,
    who add the forcing to a_i and so fall short of U where a pressure has to be overcome). A
    particle that leaves the channel at the fringe's start comes back behind its end with the
    inflow's velocity; what the pressure does not balance in between the fringe holds. An inflow
    that changes in time, stops or turns round among it, is that of both ends at once: its
    derivative dU/dt at a place keeps the fluid from lagging behind.

    Args:
        profile: positions (N, n) [m] and a time [s] -> velocities of the inflow (N, n) [m/s]; an
            `eqx.Module`, whose arrays may be swept and differentiated, smooth in time.
        rate: [1/s], within the stability of the step.
        start, end: of the fringe along the first axis [m] (static).

    Raises:
        ValueError: if the end does not lie behind the start.
    """

    profile: eqx.Module
    rate: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    start: float = eqx.field(static=True)
    end: float = eqx.field(static=True)

    def __check_init__(self):
        if not self.start < self.end:
            raise ValueError(f"fringe: its end {self.end:g} m must lie behind {self.start:g} m.")

    def step_limit(self, fluid, space):
        acting = self.rate > 0.0
        return jnp.where(acting, _STABLE / jnp.where(acting, self.rate, 1.0), jnp.inf)

    def governed(self, context, fields, rates):
        position = fields["position"]
        along = (position[:, 0] - self.start) / (self.end - self.start)
        share = jnp.where(along <= 1.0, ramp(along, 0.0, _RISE), 0.0)[:, None]
        inflow, change = held(self.profile, position, context.time)
        pull = change - self.rate * (fields["velocity"] - inflow)
        return rates | {"velocity": rates["velocity"] + share * (pull - rates["velocity"])}


def held(
    profile: eqx.Module, position: Float[Array, "points dim"], time: Float[Array, ""]
) -> tuple[Float[Array, "points dim"], Float[Array, "points dim"]]:
    """An inflow's velocities [m/s] and their rates of change [m/s^2], in the precision of the
    positions whatever the profile's numbers have."""
    found = jax.jvp(partial(profile, position), (time,), (jnp.ones_like(time),))
    return tuple(each.astype(position.dtype) for each in found)


class ParabolicProfile(eqx.Module):
    """u = 4 U y (H - y) / H^2 along the first axis, between walls at y = 0 and y = H.

    Args:
        peak: U [m/s].
        height: H [m] (static).
    """

    peak: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    height: float = eqx.field(static=True)

    def __call__(
        self, position: Float[Array, "points dim"], time: Float[Array, ""]
    ) -> Float[Array, "points dim"]:
        """Velocities [m/s] at positions [m], the same at all times."""
        y = position[:, 1]
        speed = (4.0 / self.height**2) * self.peak * y * (self.height - y)
        return jnp.zeros_like(position).at[:, 0].set(speed)


class UniformProfile(eqx.Module):
    """u = U along the first axis, everywhere and at all times.

    Args:
        speed: U [m/s].
    """

    speed: Float[Array, ""] = eqx.field(converter=jnp.asarray)

    def __call__(
        self, position: Float[Array, "points dim"], time: Float[Array, ""]
    ) -> Float[Array, "points dim"]:
        """Velocities [m/s] at positions [m], the same at all times."""
        return jnp.zeros_like(position).at[:, 0].set(self.speed)


class Varying(eqx.Module):
    """u = f(t) u_0(x, t), an inflow's profile that changes in strength.

    Args:
        profile: u_0.
        factor: time [s] -> f, smooth; negative where the flow turns round. An `eqx.Module`, or a
            function by its name.
    """

    profile: eqx.Module
    factor: Callable

    def __call__(
        self, position: Float[Array, "points dim"], time: Float[Array, ""]
    ) -> Float[Array, "points dim"]:
        """Velocities [m/s] at positions [m] at a time [s]."""
        return self.factor(time) * self.profile(position, time)
