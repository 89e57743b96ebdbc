"""The one time loop, for every model that speaks the protocol."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float

from ..compiled import full_precision
from .checkpoints import segment_length
from .faults import Fault, FaultCode
from .model import Model
from .stepping import FixedSteps, Stepping


@full_precision
def integrate(
    model: Model,
    state: Any,
    first_step: Array,
    time_step: Float[Array, ""],
    steps_per_snapshot: int,
    snapshots: int,
    stepping: Stepping = FixedSteps(),  # noqa: B008
    checkpoints: int | None = None,
) -> tuple[Any, Fault, Any, Array]:
    """Steps over `snapshots` intervals of `steps_per_snapshot` dt each, in nested `lax.scan`s.

    Pure: jit, vmap and differentiate it. The auxiliary structure is built anew at the start of
    every interval, so that a run which starts from a snapshot repeats this one bit by bit. After
    a fault the last good state stays and the remaining steps do nothing.

    Reverse mode keeps `checkpoints` states and runs the steps between them once more: memory grows
    as the square root of the steps, and a gradient costs one run more than if all were kept.

    Args:
        model: what to integrate.
        state: where to start.
        first_step: number of the step before the first, so that time = step * time_step.
        time_step: dt [s].
        steps_per_snapshot: of dt in an interval.
        snapshots: intervals.
        stepping: equal steps of dt, or steps chosen within each interval; and by which `Stepper`,
            RK4 unless another is given.
        checkpoints: states that reverse mode keeps, at least one for each interval; twice the
            square root of the number of steps if none is given. More cost memory and save no time.

    Returns:
        the last good state, the fault (code 0 if none), what the model observes after each interval
        with a leading axis of length `snapshots`, and which of these are good.
    """

    segment = segment_length(steps_per_snapshot, snapshots, checkpoints)

    def interval(carry, start):
        state, fault = stepping.advance(
            model, *carry, start, time_step, steps_per_snapshot, segment
        )
        good = fault.code == int(FaultCode.NONE)
        return (state, fault), (model.observe(state), good)

    starts = jnp.asarray(first_step, jnp.int32) + steps_per_snapshot * jnp.arange(
        snapshots, dtype=jnp.int32
    )
    (state, fault), (observed, good) = lax.scan(interval, (state, Fault.none()), starts)
    return state, fault, observed, good
