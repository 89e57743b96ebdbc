"""The one time loop, for every model that speaks the protocol."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float

from ..trajectory import Snapshot
from .faults import Fault, FaultCode
from .model import Model
from .runge_kutta import rk4_step


def integrate(
    model: Model,
    state: Any,
    first_step: Array,
    time_step: Float[Array, ""],
    steps_per_snapshot: int,
    snapshots: int,
) -> tuple[Any, Fault, Snapshot, Array]:
    """RK4 over `snapshots` intervals of `steps_per_snapshot` steps each, in nested `lax.scan`s.

    Pure: jit, vmap and differentiate it. The auxiliary structure is built anew at the start of
    every interval, so that a run which starts from a snapshot repeats this one bit by bit. After
    a fault the last good state stays and the remaining steps do nothing.

    Args:
        model: what to integrate.
        state: where to start.
        first_step: number of the step before the first, so that time = step * time_step.
        time_step: dt [s].

    Returns:
        the last good state, the fault (code 0 if none), the snapshot after each interval with
        a leading axis of length `snapshots`, and which of these are good.
    """

    def step(carry, number):
        def advance(carry):
            state, auxiliary, _ = carry
            auxiliary = model.refresh(auxiliary, state, time_step)
            time = (number - 1).astype(time_step.dtype) * time_step
            new = rk4_step(lambda t, y: model.rates(t, y, auxiliary), time, state, time_step)
            new = model.finish(new)
            fault = model.inspect(number, new, auxiliary)
            good = fault.code == int(FaultCode.NONE)
            kept = jax.tree.map(lambda a, b: jnp.where(good, a, b), new, state)
            return kept, auxiliary, fault

        good = carry[2].code == int(FaultCode.NONE)
        return lax.cond(good, advance, lambda carry: carry, carry), None

    def interval(carry, start):
        state, fault = carry
        numbers = start + 1 + jnp.arange(steps_per_snapshot, dtype=jnp.int32)
        (state, _, fault), _ = lax.scan(step, (state, model.prepare(state), fault), numbers)
        good = fault.code == int(FaultCode.NONE)
        return (state, fault), (model.observe(state), good)

    starts = jnp.asarray(first_step, jnp.int32) + steps_per_snapshot * jnp.arange(
        snapshots, dtype=jnp.int32
    )
    (state, fault), (observed, good) = lax.scan(interval, (state, Fault.none()), starts)
    return state, fault, observed, good
