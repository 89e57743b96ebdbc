"""How the steps of an interval between two snapshots are chosen."""

from __future__ import annotations

import abc
from typing import Any, final

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .checkpoints import checkpointed_scan
from .faults import Fault, FaultCode
from .model import Model
from .one_or_many import moved_if
from .runge_kutta import RK4
from .stepper import Stepper

_ENDED = 1e-6  # of an interval: less than this is round-off


class Stepping(eqx.Module):
    """A rule for the steps of an interval."""

    @abc.abstractmethod
    def advance(
        self,
        model: Model,
        state: Any,
        fault: Fault,
        start: Array,
        time_step: Float[Array, ""],
        steps: int,
        segment: int,
    ) -> tuple[Any, Fault]:
        """The last good state of the interval and the fault (code 0 if none), in one scan.

        Args:
            model: what to integrate.
            state: where the interval starts.
            fault: of the run so far; nothing is done after one.
            start: number of the step before the interval.
            time_step: dt [s].
            steps: of dt in the interval.
            segment: steps between two states that reverse mode keeps.
        """


def _step(stepper: Stepper, model: Model, state, auxiliary, number, time, time_step):
    """One step, checked: the last good state, the auxiliary structure, the fault, and the state
    before it."""
    state, auxiliary = model.at(time).keep_up(state, auxiliary, time_step)
    new = stepper.step(lambda t, y: model.rates(t, y, auxiliary), time, state, time_step)
    new = model.finish(new)
    fault = model.at(time + time_step).inspect(number, new, auxiliary)
    good = fault.code == int(FaultCode.NONE)
    kept = jax.tree.map(lambda a, b: jnp.where(good, a, b), new, state)
    return kept, auxiliary, fault, state


@final
class FixedSteps(Stepping):
    """Equal steps of dt, the paper's.

    Args:
        stepper: the method of a step.
    """

    stepper: Stepper = RK4()

    def advance(self, model, state, fault, start, time_step, steps, segment):
        def step(carry, number):
            def move(carry):
                state, auxiliary, _ = carry
                time = (number - 1).astype(time_step.dtype) * time_step
                return _step(self.stepper, model, state, auxiliary, number, time, time_step)[:3]

            good = carry[2].code == int(FaultCode.NONE)
            return moved_if(good, move, carry)

        numbers = start + 1 + jnp.arange(steps, dtype=jnp.int32)
        began = start.astype(time_step.dtype) * time_step
        carry = (*model.at(began).begin(state), fault)
        state, auxiliary, fault = checkpointed_scan(step, carry, numbers, segment)
        return model.end(state, auxiliary), fault


@final
class AutomaticSteps(Stepping):
    """Steps as long as the model's own limits allow, each interval a whole number of them.

    `Model.step_limit` gives the limit of each step from the state and from the largest change of
    velocity in the step before. The scan is `most` times as long as one of dt would be; what is
    left of it once the interval's end is reached does nothing. A fault's step is counted in dt.

    Args:
        most: steps of an interval, times those of dt (static).
        stepper: the method of a step; the model's limits are those of RK4.
    """

    most: int = eqx.field(static=True, default=4)
    stepper: Stepper = RK4()

    def __check_init__(self):
        if self.most < 1:
            raise ValueError(f"most: at least 1, got {self.most}.")

    def advance(self, model, state, fault, start, time_step, steps, segment):
        duration, began = steps * time_step, start.astype(time_step.dtype) * time_step

        def going(carry):
            _, _, fault, elapsed, _ = carry
            left = duration - elapsed > _ENDED * duration
            return left & (fault.code == int(FaultCode.NONE))

        def move(carry):
            state, auxiliary, _, elapsed, change = carry
            left = duration - elapsed
            time = began + elapsed
            step = left / jnp.ceil(left / model.at(time).step_limit(state, change))
            step = jnp.where(jnp.isfinite(step), step, time_step)  # the step's checks name the rest
            number = start + jnp.ceil((elapsed + step) / time_step - _ENDED).astype(jnp.int32)
            new, auxiliary, fault, state = _step(
                self.stepper, model, state, auxiliary, number, time, step
            )
            return new, auxiliary, fault, elapsed + step, model.largest_change(state, new) / step

        def step(carry, _):
            return moved_if(going(carry), move, carry)

        zero = jnp.zeros((), time_step.dtype)
        carry = (*model.at(began).begin(state), fault, zero, zero)
        carry = checkpointed_scan(step, carry, jnp.arange(self.most * steps), segment)
        state, auxiliary, fault, elapsed, _ = carry
        short = going(carry)
        number = start + jnp.ceil(elapsed / time_step).astype(jnp.int32)
        out = Fault.first_of(number, (FaultCode.STEPS_EXHAUSTED, short, -1))
        fault = jax.tree.map(lambda a, b: jnp.where(short, a, b), out, fault)
        return model.end(state, auxiliary), fault
