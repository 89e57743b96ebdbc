"""When a reduced run is looked at, and how it gets there."""

from __future__ import annotations

import abc
from typing import Self, final

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Float, Int

from jaxsph import Schedule
from jaxsph.integrate import Fault, FaultCode, integrate, rk4_step

from ..dynamics.points_model import PointsModel


class Times(eqx.Module):
    """Steps from time 0 on, and times at which coordinates are wanted."""

    @property
    @abc.abstractmethod
    def count(self) -> int:
        """Of the times."""

    @abc.abstractmethod
    def run(
        self, model: PointsModel, start: Float[Array, " modes"]
    ) -> tuple[Float[Array, "times modes"], Fault, Bool[Array, " times"]]:
        """Coordinates at the times, the fault (code 0 if none), and which of them are good."""


@final
class EvenTimes(Times):
    """At the end of even intervals, by the full model's loop.

    Args:
        time_step: dt [s].
        steps: of dt in an interval (static).
        intervals: how many (static).
    """

    time_step: Float[Array, ""]
    steps: int = eqx.field(static=True)
    intervals: int = eqx.field(static=True)

    @classmethod
    def of(cls, schedule: Schedule, dtype) -> Self:
        """Those of a schedule."""
        step = jnp.asarray(schedule.time_step, dtype)
        return cls(step, schedule.steps_per_snapshot, schedule.intervals)

    @property
    def count(self):
        return self.intervals

    def run(self, model, start):
        first = jnp.zeros((), jnp.int32)
        _, fault, found, good = integrate(
            model, start, first, self.time_step, self.steps, self.intervals
        )
        return found, fault, good


@final
class GivenTimes(Times):
    """At any times, by equal steps from each to the next.

    Args:
        times: [s].
        counts: of steps to each.
        steps: the most of these; what a shorter gap does not need does nothing (static).
    """

    times: Float[Array, " times"]
    counts: Int[Array, " times"]
    steps: int = eqx.field(static=True)

    @classmethod
    def of(cls, times: Float[np.ndarray, " times"], time_step: float, dtype) -> Self:
        """As few steps of at most dt as there can be.

        Raises:
            ValueError: if times are negative or do not increase.
        """
        times = np.atleast_1d(np.asarray(times, float))
        gaps = np.diff(times, prepend=0.0)
        if times.ndim != 1 or not len(times) or not np.isfinite(times).all():
            raise ValueError("times: give at least one, all of them finite.")
        if gaps[0] < 0.0 or (gaps[1:] <= 0.0).any():
            raise ValueError("times: from 0 on and increasing; sort them and leave out repeats.")
        counts = np.maximum(np.ceil(gaps / time_step * (1.0 - 1e-9)), 1.0).astype(np.int32)
        return cls(jnp.asarray(times, dtype), jnp.asarray(counts), int(counts.max()))

    @property
    def count(self):
        return len(self.times)

    def run(self, model, start):
        before = jnp.concatenate([jnp.zeros_like(self.times[:1]), self.times[:-1]])
        numbers = jnp.cumsum(self.counts) - self.counts
        inner = jnp.arange(self.steps, dtype=jnp.int32)

        def step(carry, number, time, length):
            state, fault = carry
            new = rk4_step(lambda t, y: model.rates(t, y, None), time, state, length)
            found = model.inspect(number, new, None)
            good = fault.code == int(FaultCode.NONE)
            fault = jax.tree.map(lambda a, b: jnp.where(good, a, b), found, fault)
            good = fault.code == int(FaultCode.NONE)
            return jnp.where(good, new, state), fault

        def interval(carry, span):
            first, start, end, count = span
            length = (end - start) / count.astype(start.dtype)

            def one(carry, k):
                time = start + length * k.astype(start.dtype)
                taken = jnp.where(k < count, length, jnp.zeros_like(length))
                return step(carry, first + k + 1, time, taken), None

            carry, _ = lax.scan(one, carry, inner)
            return carry, (carry[0], carry[1].code == int(FaultCode.NONE))

        (_, fault), (found, good) = lax.scan(
            interval, (start, Fault.none()), (numbers, before, self.times, self.counts)
        )
        return found, fault, good
