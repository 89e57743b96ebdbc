"""The protocol that the time loop speaks: full and reduced models are the same kind of thing."""

from __future__ import annotations

import abc
from typing import Any

import equinox as eqx
from jaxtyping import Array, Float

from ..trajectory import Snapshot
from .faults import Fault


class Model(eqx.Module):
    """A dynamical system dy/dt = f(t, y) with an auxiliary structure (a neighbour list, say) that
    is rebuilt now and then and is not differentiated."""

    def at(self, time: Float[Array, ""]) -> Model:
        """The model at a time [s], its walls where they are then; itself if it has none that move.

        `prepare`, `refresh`, `inspect` and `step_limit` are asked of this one; `rates` knows its
        time, and may be asked of either.
        """
        return self

    @abc.abstractmethod
    def prepare(self, state: Any) -> Any:
        """The auxiliary structure for a state, built anew."""

    @abc.abstractmethod
    def refresh(self, auxiliary: Any, state: Any, time_step: Float[Array, ""]) -> Any:
        """The auxiliary structure, rebuilt if it would not last another step."""

    @abc.abstractmethod
    def rates(self, time: Float[Array, ""], state: Any, auxiliary: Any) -> Any:
        """dy/dt, a pytree like the state."""

    @abc.abstractmethod
    def finish(self, state: Any) -> Any:
        """A state as a step leaves it (positions wrapped into the box)."""

    @abc.abstractmethod
    def inspect(self, step: Array, state: Any, auxiliary: Any) -> Fault:
        """What is wrong with a step's result, if anything."""

    def likely_cause(self, fault: Fault, state: Any, time_step: float) -> str | None:
        """What a fault most likely comes from and what to do, told by the last good state on the
        host; None if nothing stands out."""
        return None

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

    @abc.abstractmethod
    def observe(self, state: Any) -> Snapshot:
        """The particle fields to record."""
