"""Spectral radius of a matrix that is known by its action alone."""

from __future__ import annotations

from collections.abc import Callable

import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float


def krylov_projection(
    action: Callable[[Float[Array, " size"]], Float[Array, " size"]],
    start: Float[Array, " size"],
    steps: int,
) -> Float[Array, "steps steps"]:
    """Q^T A Q on the Krylov space of v, A v, ..., A^{steps-1} v (Arnoldi 1951).

    These are the vectors of a power iteration, orthonormalised as they come. The power iteration
    itself has no limit in direction where the dominant eigenvalues are a complex-conjugate pair, as
    those of sound are; the eigenvalues of Q^T A Q (Ritz values) have one, and are those of A
    once the steps reach its size.

    Args:
        action: v -> A v; pure.
        start: v, not zero.
        steps: actions taken.
    """

    def step(basis, number):
        ahead = action(basis[number])
        whole = jnp.linalg.norm(ahead)
        along = jnp.zeros((steps + 1,), start.dtype)
        for _ in range(2):  # once leaves rounding errors that grow
            part = basis @ ahead
            ahead, along = ahead - part @ basis, along + part
        norm = jnp.linalg.norm(ahead)
        new = norm > rounding * whole  # else the space is complete, and what is left is noise
        ahead = jnp.where(new, ahead / jnp.where(new, norm, 1.0), 0.0)
        return basis.at[number + 1].set(ahead), along.at[number + 1].set(jnp.where(new, norm, 0.0))

    rounding = 100.0 * jnp.finfo(start.dtype).eps
    basis = jnp.zeros((steps + 1, start.shape[0]), start.dtype)
    basis = basis.at[0].set(start / jnp.linalg.norm(start))
    _, columns = lax.scan(step, basis, jnp.arange(steps))
    return columns[:, :steps].T


def spectral_radius(matrix: Float[np.ndarray, "size size"]) -> float:
    """max |lambda| of a small matrix."""
    return float(np.abs(np.linalg.eigvals(np.asarray(matrix, np.float64))).max())
