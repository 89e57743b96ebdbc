"""What a projection is."""

from __future__ import annotations

import abc
from collections.abc import Callable

import equinox as eqx
import jax.numpy as jnp
import jax.scipy.linalg
from jaxtyping import Array, Float


class PseudoInverse(eqx.Module):
    """Phi^+ in a weighted inner product, by the Cholesky factor of the Gram matrix.

    At particle positions the interpolated basis is not orthonormal, so this is a real
    least-squares solve.
    """

    basis: Float[Array, "states modes"]
    weighted: Float[Array, "states modes"]
    factor: Float[Array, "modes modes"]

    def __init__(self, basis: Float[Array, "states modes"], weights: Float[Array, " states"]):
        self.basis = basis
        self.weighted = basis * weights[:, None]
        self.factor = jnp.linalg.cholesky(basis.T @ self.weighted)

    def __call__(self, vector: Float[Array, " states"]) -> Float[Array, " modes"]:
        """Phi^+ v: the coordinates nearest to v."""
        return jax.scipy.linalg.cho_solve((self.factor, True), self.weighted.T @ vector)

    def complement(self, vector: Float[Array, " states"]) -> Float[Array, " states"]:
        """Pi' v = v - Phi Phi^+ v."""
        return vector - self.basis @ self(vector)


class Projection(eqx.Module):
    """A rule that turns full rates into rates of the reduced coordinates."""

    @property
    @abc.abstractmethod
    def name(self) -> str:
        """As users type it."""

    @abc.abstractmethod
    def reduce(
        self,
        inverse: PseudoInverse,
        functional: Callable[[Float[Array, " states"]], Float[Array, " states"]],
        state: Float[Array, " states"],
        rates: Float[Array, " states"],
    ) -> Float[Array, " modes"]:
        """d(coordinates)/dt.

        Args:
            inverse: pseudo-inverse of the basis at the particles.
            functional: f-bar of the stacked state at frozen positions.
            state: where to evaluate.
            rates: f-bar(state), computed already.
        """
