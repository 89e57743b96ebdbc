"""Openings, through which fluid comes in and goes out, each with a buffer of particles."""

from __future__ import annotations

import math

import equinox as eqx
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Bool, Float

from ..parking import Parking
from ..particles import ParticleState
from ..ramps import ramp
from .base import Effect
from .fringe import held

_FRONT = 0.7  # of the way from the mouth to the reserve
_WITHIN = 1.0 - 1e-6  # of the front: a row of a lattice may lie on its very end, by round-off
_LEAST = 1e-3  # particles in a cell that has a mean of its own
_STABLE = 2.0  # over the rate; RK4 stands 2.78


def _array(value):
    """A number as an array, which may be swept; None as it is."""
    return None if value is None else jnp.asarray(value)


class Opening(eqx.Module):
    """A part of the flow's border, and the buffer of particles behind it.

    The buffer is a cuboid behind its mouth. In its front, next to the mouth, the fluid's own rates
    of what the opening prescribes fade out: of the velocity at an inlet, of the density, by the
    pressure, at an outlet. What it leaves open goes on by its own rates there; further back it
    becomes the mean over the front, at each place across the mouth. The rear is the reserve, where
    along each line across the mouth particles move as one: as many as start there come in again and
    again. Through either kind of opening fluid may go both ways.

    Args:
        velocity: positions (N, n) [m] and a time [s] -> velocities (N, n) [m/s], the same
            everywhere along a line across the mouth; an `eqx.Module`, smooth in time.
        pressure: [Pa].
        pressure_rate: at which that pressure is come back to [1/s]; the slower, the less of the
            sound that comes to the opening is thrown back (Rudy and Strikwerda 1980 take 0.3 c0
            over the length of the flow).
        lower, upper: corners of the buffer [m] (static).
        axis: along which fluid goes through (static).
        inward: 1.0 if it comes in along that axis, -1.0 if against it (static).
        reserve: length of the reserve [m], a whole number of particles; at least the kernel's
            support and a half, so that those that come out of it miss none (static).
        cell: width of the means over places across the mouth [m] (static).
        periodic: axes across the mouth along which it goes all round a periodic box (static).

    Raises:
        ValueError: if the corners span no cuboid, an axis, a length or `inward` is none, or a
            pressure comes without its rate.
    """

    velocity: eqx.Module | None
    pressure: Float[Array, ""] | None = eqx.field(converter=_array)
    pressure_rate: Float[Array, ""] | None = eqx.field(converter=_array)
    lower: tuple[float, ...] = eqx.field(static=True)
    upper: tuple[float, ...] = eqx.field(static=True)
    axis: int = eqx.field(static=True)
    inward: float = eqx.field(static=True)
    reserve: float = eqx.field(static=True)
    cell: float = eqx.field(static=True)
    periodic: tuple[int, ...] = eqx.field(static=True, default=())

    def __check_init__(self):
        if not 0 <= self.axis < len(self.lower):
            raise ValueError(f"opening: axis {self.axis} in {len(self.lower)} dimensions.")
        if not self.cell > 0.0:
            raise ValueError(f"opening: cells must be wider than zero, got {self.cell:g} m.")
        if not all(a < b for a, b in zip(self.lower, self.upper, strict=True)):
            raise ValueError(f"opening: {self.upper} m must lie beyond {self.lower} m.")
        if not 0.0 < self.reserve < self.length:
            raise ValueError(
                f"opening: a reserve of {self.reserve:g} m in a buffer of {self.length:g} m; let "
                "it be a part of that."
            )
        if (self.pressure is None) != (self.pressure_rate is None):
            raise ValueError("opening: a pressure and its rate belong together; give both or none.")
        if self.inward not in (-1.0, 1.0):
            raise ValueError(f"opening: inward is 1.0 or -1.0, got {self.inward:g}.")

    @property
    def length(self) -> float:
        """Of the buffer [m]."""
        return self.upper[self.axis] - self.lower[self.axis]

    @property
    def before_reserve(self) -> float:
        """Depth at which the reserve begins [m]."""
        return self.length - self.reserve

    def depth(self, position: Float[Array, "particles dim"]) -> Float[Array, " particles"]:
        """How far behind the mouth [m]; negative in the flow."""
        mouth = (self.lower, self.upper)[self.inward > 0.0][self.axis]
        return self.inward * (mouth - position[:, self.axis])

    def spans(self, position: Float[Array, "particles dim"]) -> Bool[Array, " particles"]:
        """Whether a place lies on a line across the mouth."""
        inside = jnp.ones(position.shape[0], bool)
        for k in self._across:
            x = position[:, k]
            inside = inside & (x >= self.lower[k]) & (x <= self.upper[k])
        return inside

    def shares(
        self, position: Float[Array, "particles dim"]
    ) -> tuple[Float[Array, " particles"], Float[Array, " particles"]]:
        """Of what the opening prescribes in the rates, and of what it takes from the front: 0 in
        the flow, 1 in the reserve."""
        way, inside = self.depth(position) / self.before_reserve, self.spans(position)
        of_front, of_back = ramp(way, 0.0, _FRONT), ramp(way, _FRONT, 1.0)
        return jnp.where(inside, of_front, 0.0), jnp.where(inside, of_back, 0.0)

    def entering(self, position, since) -> Bool[Array, " particles"]:
        """Which particles have come out of the reserve on their way from `since`."""
        border = self.before_reserve
        before, now = self.depth(since), self.depth(position)
        return (before > border) & (now <= border) & self.spans(position)

    def leaving(self, position) -> Bool[Array, " particles"]:
        """Which particles have gone out at the end of the buffer."""
        return (self.depth(position) > self.length) & self.spans(position)

    def in_buffer(self, position) -> Bool[Array, " particles"]:
        """Which particles are behind the mouth."""
        depth = self.depth(position)
        return (depth > 0.0) & (depth <= self.length) & self.spans(position)

    def behind(self, position: Float[Array, "particles dim"]) -> Float[Array, "particles dim"]:
        """Places a reserve's length further out [m]."""
        return position.at[:, self.axis].add(-self.inward * self.reserve)

    def in_front(
        self, position: Float[Array, "particles dim"], values: Float[Array, "particles fields"]
    ) -> Float[Array, "particles fields"]:
        """Values of the fluid in the front, at the places across the mouth of all particles.

        Means over cells across the mouth, linear between them; the mean of all where one is empty,
        a particle's own values where no particle is in the front.
        """
        depth, end = self.depth(position), _WITHIN * _FRONT * self.before_reserve
        inside = self.spans(position) & (depth >= 0.0) & (depth < end)
        weighed = jnp.concatenate([values, jnp.ones_like(values[:, :1])], axis=1)
        weighed = jnp.where(inside[:, None], weighed, 0.0)
        corners, cells = self._corners(position)
        total = jnp.zeros((cells, weighed.shape[1]), weighed.dtype)
        for cell, share in corners:
            total = total.at[cell].add(share[:, None] * weighed)
        mean = jnp.sum(total, axis=0)
        mean = mean / jnp.maximum(mean[-1:], _LEAST)
        known = total[:, -1:] > _LEAST
        table = jnp.where(known, total / jnp.where(known, total[:, -1:], 1.0), mean[None])
        found = sum(share[:, None] * table[cell, :-1] for cell, share in corners)
        return jnp.where(jnp.any(known), found, values)

    @property
    def _across(self) -> tuple[int, ...]:
        return tuple(k for k in range(len(self.lower)) if k != self.axis)

    def _corners(self, position: Float[Array, "particles dim"]):
        """The cells about each place across the mouth and its shares in them, linear between their
        middles; and how many cells there are."""
        corners = [(jnp.zeros(position.shape[0], jnp.int32), jnp.ones_like(position[:, 0]))]
        cells = 1
        for k in self._across:
            length = self.upper[k] - self.lower[k]
            count = max(1, round(length / self.cell))
            along = (position[:, k] - self.lower[k]) * (count / length) - 0.5
            if k not in self.periodic:
                along = jnp.clip(along, 0.0, count - 1.0)
            # the nearest and both beside it, not a floor and the next: rows of a lattice lie on the
            # middles, and a compiled program may hold two floors that are rounded either way
            nearest = jnp.round(lax.stop_gradient(along))
            sides = []
            for step in (-1.0, 0.0, 1.0):
                share = jnp.maximum(1.0 - jnp.abs(along - (nearest + step)), 0.0)
                sides.append(((nearest + step).astype(jnp.int32) % count, share))
            corners = [
                (cell * count + own, share * part) for cell, share in corners for own, part in sides
            ]
            cells *= count
        return corners, cells


class Openings(Effect):
    """In the buffers of openings

        du_i/dt = (1 - s_i) a_i + s_i [dU/dt - rate (u_i - U(x_i, t))],
        drho_i/dt = (1 - q_i) r_i + q_i rate (R_i - rho_i)  or, where a pressure is given,
        drho_i/dt = (1 - q_i) r_i + q_i [(rho0 / c0) A_i + pressure_rate (R_i - rho_i)],
        dx_i/dt = u_i + (1 - s_i) d_i  where fluid comes in,

    a_i, r_i and d_i what all other effects give; U the velocity and R the density of the
    opening's pressure where it has one, or the means of the fluid in its front, of its velocity
    through the mouth; A the mean of a in the front, outwards, by which a sound wave that goes out
    finds itself there and none comes back (Poinsot and Lele 1992). The shares s and q rise from 0
    to 1 along the front for what is prescribed, behind it for what is not.

    A particle that comes out of a reserve towards the flow is put in once more at the reserve's
    end, with the fields it has; one that goes out at the end is parked. Both are done where a
    neighbour list is made anew; the numbers of particles and of those parked hold what flows.
    Derivatives are those of the flow with the same particles put in at the same times.

    Args:
        openings: as many as there are.
        rate: [1/s], within the stability of the step.
        parking: where particles wait that are in no flow (static).

    Raises:
        ValueError: from a scene, if a reserve is shorter than the kernel's support.
    """

    openings: tuple[Opening, ...]
    rate: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    parking: Parking = eqx.field(static=True)

    def on_fixed_points(self):
        raise ValueError(
            "Openings: put particles in, which has no meaning on points that do not move; learn "
            "from the flow with a Fringe."
        )

    def parks_at(self):
        return self.parking

    def step_limit(self, fluid, space):
        rates = [o.pressure_rate for o in self.openings if o.pressure_rate is not None]
        rate = jnp.max(jnp.stack([self.rate, *rates]))
        acting = rate > 0.0
        return jnp.where(acting, _STABLE / jnp.where(acting, rate, 1.0), jnp.inf)

    def step_limit_from(self, position, fluid, space):
        for opening in self.openings:
            if opening.reserve < space.support:
                raise ValueError(
                    f"opening: a reserve of {opening.reserve:.3g} m is shorter than the kernel's "
                    f"support of {space.support:.3g} m; particles that come out of it would miss "
                    "some of their neighbours. Take half as much again as that."
                )
            if opening.velocity is not None and not opening.in_buffer(position).any():
                low, up = (", ".join(f"{x:g}" for x in c) for c in (opening.lower, opening.upper))
                raise ValueError(
                    f"opening: no particle is in the buffer of the inlet from ({low}) m to ({up}) "
                    "m, and as many as start in its reserve come in again and again; fill it."
                )
        return math.inf

    def governed(self, context, fields, rates):
        position, velocity, density = (fields[name] for name in ("position", "velocity", "density"))
        drift, fluid = rates["position"] - velocity, context.fluid
        for opening in self.openings:
            prescribed, left_open = opening.shares(position)
            out = -opening.inward * rates["velocity"][:, opening.axis]
            read = (velocity, density[:, None], out[:, None])
            known = opening.in_front(position, jnp.concatenate(read, axis=1))
            wanted = jnp.zeros_like(velocity).at[:, opening.axis].set(known[:, opening.axis])
            change, own = jnp.zeros_like(velocity), left_open[:, None]
            if opening.velocity is not None:
                own = prescribed[:, None]
                wanted, change = held(opening.velocity, position, context.time)
            fill, share = self.rate * (known[:, -2] - density), left_open
            if opening.pressure is not None:
                sound = (fluid.reference_density / fluid.sound_speed) * known[:, -1]
                back = fluid.density(opening.pressure) - density
                fill, share = sound + opening.pressure_rate * back, prescribed
            pull = change - self.rate * (velocity - wanted)
            comes_in = opening.inward * wanted[:, opening.axis : opening.axis + 1] > 0.0
            drift = jnp.where(comes_in, 1.0 - own, 1.0) * drift
            rates = rates | {
                "velocity": rates["velocity"] + own * (pull - rates["velocity"]),
                "density": rates["density"] + share * (fill - rates["density"]),
            }
        flowing = ~self.parking.holds(position)
        rates = rates | {"position": velocity + drift}
        return {
            name: jnp.where(flowing.reshape((-1,) + (1,) * (rate.ndim - 1)), rate, 0.0)
            for name, rate in rates.items()
        }

    def exchanged(self, state, since, fluid):
        position = state.position
        entering, leaving, copied = self._crossing(position, since)
        free = leaving | self.parking.holds(position)
        count = position.shape[0]
        numbers = jnp.arange(count, dtype=jnp.int32)
        rank = jnp.cumsum(entering.astype(jnp.int32), dtype=jnp.int32) - 1
        donors = jnp.zeros(count, jnp.int32)
        donors = donors.at[jnp.where(entering, rank, count)].set(numbers, mode="drop")
        rank = jnp.cumsum(free.astype(jnp.int32), dtype=jnp.int32) - 1
        put_in = free & (rank < jnp.sum(entering, dtype=jnp.int32))
        donor = donors[jnp.clip(rank, 0, count - 1)]
        away = (leaving & ~put_in)[:, None]
        place = jnp.asarray(self.parking.place, position.dtype)[None]
        there = jnp.where(away, place, position)
        still = jnp.where(away, 0.0, state.velocity)
        rest = jnp.where(away[:, 0], fluid.reference_density, state.density)
        return ParticleState(
            jnp.where(put_in[:, None], copied[donor], there),
            jnp.where(put_in[:, None], state.velocity[donor], still),
            jnp.where(put_in, state.density[donor], rest),
            state.bodies,
        )

    def exhausted(self, position, since):
        entering, leaving, _ = self._crossing(position, since)
        return jnp.sum(entering) > jnp.sum(leaving | self.parking.holds(position))

    def _crossing(self, position, since):
        """Which particles have come out of a reserve and which have left, and where those that are
        put in for the first come to be."""
        parked = self.parking.holds(position) | self.parking.holds(since)
        entering, leaving, copied = jnp.zeros_like(parked), jnp.zeros_like(parked), position
        for opening in self.openings:
            own = opening.entering(position, since) & ~parked
            copied = jnp.where(own[:, None], opening.behind(position), copied)
            entering = entering | own
            leaving = leaving | (opening.leaving(position) & ~parked)
        return entering, leaving, copied
