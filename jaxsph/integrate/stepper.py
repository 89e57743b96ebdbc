"""What a one-step method is."""

from __future__ import annotations

import abc
from collections.abc import Callable
from typing import Any

import equinox as eqx
from jaxtyping import Array, Float


class Stepper(eqx.Module):
    """An explicit one-step method for dy/dt = f(t, y)."""

    @abc.abstractmethod
    def step(
        self,
        rates: Callable[[Float[Array, ""], Any], Any],
        time: Float[Array, ""],
        state: Any,
        time_step: Float[Array, ""],
    ) -> Any:
        """y(t + dt) from y(t), inside jit and differentiable.

        Args:
            rates: f, a pytree like the state.
            time: t [s].
            state: y, a pytree.
            time_step: dt [s].
        """
