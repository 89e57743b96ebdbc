"""The protocol that the time loop speaks: full and reduced models are the same kind of thing."""

from __future__ import annotations

import abc
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..devices import Devices
from .faults import Fault, FaultCode


class Model(eqx.Module):
    """A dynamical system dy/dt = f(t, y); `rates` is all that it must have.

    It may keep an auxiliary structure (a neighbour list, say) that is rebuilt now and then and is
    not differentiated; there is none unless a model has its own `prepare` and `refresh`.
    """

    def at(self, time: Float[Array, ""]) -> Model:
        """The model at a time [s], its walls where they are then; itself if it has none that move.

        `prepare`, `refresh`, `inspect` and `step_limit` are asked of this one; `rates` knows its
        time, and may be asked of either.
        """
        return self

    @abc.abstractmethod
    def rates(self, time: Float[Array, ""], state: Any, auxiliary: Any) -> Any:
        """dy/dt, a pytree like the state."""

    def prepare(self, state: Any) -> Any:
        """The auxiliary structure for a state, built anew."""
        return None

    def refresh(self, auxiliary: Any, state: Any, time_step: Float[Array, ""]) -> Any:
        """The auxiliary structure, rebuilt if it would not last another step."""
        return auxiliary

    def begin(self, state: Any) -> tuple[Any, Any]:
        """A state as steps keep it, and an auxiliary structure for `keep_up`, which comes before
        all else and builds it if this has not.

        Steps keep a state as it is unless a model that several devices run arranges it otherwise;
        `rates`, `finish`, `inspect` and limits are then asked of such a state.
        """
        return state, self.prepare(state)

    def keep_up(self, state: Any, auxiliary: Any, time_step: Float[Array, ""]) -> tuple[Any, Any]:
        """The same during the steps: what `refresh` gives, and the state arranged for it."""
        return state, self.refresh(auxiliary, state, time_step)

    def end(self, state: Any, auxiliary: Any) -> Any:
        """A state that steps have kept as it was given to them."""
        return state

    def finish(self, state: Any) -> Any:
        """A state as a step leaves it (positions wrapped into the box)."""
        return state

    def inspect(self, step: Array, state: Any, auxiliary: Any) -> Fault:
        """What is wrong with a step's result, if anything; here a value that is not finite."""
        lost = [~jnp.all(jnp.isfinite(leaf)) for leaf in jax.tree.leaves(state)]
        return Fault.first_of(step, *((FaultCode.NOT_FINITE, each, -1) for each in lost))

    def likely_cause(self, fault: Fault, state: Any, time_step: float) -> str | None:
        """What a fault most likely comes from and what to do, told by the last good state on the
        host; None if nothing stands out."""
        return None

    def over(self, devices: Devices) -> Model:
        """The same model run by several devices together.

        Raises:
            ValueError: if it knows no way to divide its work.
        """
        raise ValueError(
            f"devices: a {type(self).__name__} is run by one device; leave devices out."
        )

    def enlarged(self) -> Model | None:
        """The same model with more room for neighbours, or None if there is nothing to enlarge."""
        return None

    def step_limit(self, state: Any, change: Float[Array, ""]) -> Float[Array, ""]:
        """The longest stable step [s] from a state; `change` [m/s^2] is the largest of the last.

        Raises:
            NotImplementedError: if the model knows none, and runs by fixed steps only.
        """
        raise NotImplementedError(f"{type(self).__name__} has no step limit; use FixedSteps.")

    def largest_change(self, old: Any, new: Any) -> Float[Array, ""]:
        """The largest change of a velocity [m/s] between two states, for `step_limit`."""
        raise NotImplementedError(f"{type(self).__name__} has no step limit; use FixedSteps.")

    def observe(self, state: Any) -> Any:
        """What to record: a `Snapshot`, if `simulate` is to run the model; here the state."""
        return state
