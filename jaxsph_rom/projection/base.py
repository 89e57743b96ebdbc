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
    least-squares solve. Of the basis only W^1/2 Phi is kept: whatever reads it reads it along its
    rows, so that a compiler makes it once and as it lies.
    """

    scaled: Float[Array, "states modes"]
    root: Float[Array, " states"]
    factor: Float[Array, "modes modes"]

    def __init__(self, basis: Float[Array, "states modes"], weights: Float[Array, " states"]):
        self.root = jnp.sqrt(weights)
        self.scaled = basis * self.root[:, None]
        self.factor = jnp.linalg.cholesky(self.scaled.T @ self.scaled)

    def __call__(self, vector: Float[Array, " states"]) -> Float[Array, " modes"]:
        """Phi^+ v: the coordinates nearest to v."""
        right = (self.root * vector) @ self.scaled
        return jax.scipy.linalg.cho_solve((self.factor, True), right)

    def expand(self, coordinates: Float[Array, " modes"]) -> Float[Array, " states"]:
        """Phi a."""
        return (self.scaled @ coordinates) / self.root

    def complement(self, vector: Float[Array, " states"]) -> Float[Array, " states"]:
        """Pi' v = v - Phi Phi^+ v."""
        return vector - self.expand(self(vector))


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
        functional: Callable[[Float[Array, " states"]], tuple[Float[Array, " states"], Array]],
        state: Float[Array, " states"],
    ) -> tuple[Float[Array, " modes"], Array]:
        """d(coordinates)/dt, and what the functional finds beside its rates.

        Args:
            inverse: pseudo-inverse of the basis at the particles.
            functional: f-bar of the stacked state at frozen positions, and something beside it.
            state: where to evaluate.
        """
