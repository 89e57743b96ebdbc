"""What moves reduced coordinates."""

from __future__ import annotations

import abc

import equinox as eqx
from jaxtyping import Array, Float


class Dynamics(eqx.Module):
    """da/dt = f(t, a; theta) of reduced coordinates a (M,), theta the operators' coefficients."""

    @property
    @abc.abstractmethod
    def size(self) -> int:
        """M."""

    @abc.abstractmethod
    def rates(
        self,
        time: Float[Array, ""],
        coordinates: Float[Array, " modes"],
        values: Float[Array, " coefficients"],
    ) -> Float[Array, " modes"]:
        """da/dt."""


class Closable(Dynamics):
    """Dynamics that a linear closure can be added to."""

    @abc.abstractmethod
    def plus(
        self, first: Float[Array, "modes modes"], others: Float[Array, "coefficients modes modes"]
    ) -> Closable:
        """The same and (A + sum_k theta_k A_k) a: a closure."""
