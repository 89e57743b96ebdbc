"""From a residual to an error, as the training runs have shown it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

_LEAST = 1e-12  # of a residual
_STIFFNESS = 0.1  # of the slope: what few runs say about it counts less
_FARTHEST = 1.0  # from the middle of the training range, in its widths


class Calibration(eqx.Module):
    """s(p) = exp(c + b . x), the error that a residual stands for at parameters p, x their places
    about the middle of the training range in its widths:

        (c, b) = argmin sum_k (log(e_k / r_k) - c - b . x_k)^2 + 0.1 |b|^2

    over runs of error e_k and residual r_k. What a residual means changes with the parameters: the
    less viscous a flow, the longer it remembers.

    Args:
        middle, width: of the training range (n,).
        constant: c; NaN where no run tells.
        slope: b (n,).
    """

    middle: Float[Array, " names"]
    width: Float[Array, " names"]
    constant: Float[Array, ""]
    slope: Float[Array, " names"]

    @classmethod
    def of(
        cls,
        points: Float[np.ndarray, "runs names"],
        errors: Sequence[float],
        residuals: Sequence[float],
    ) -> Self:
        """Of runs at the training points; those that were lost do not count."""
        low, high = points.min(axis=0), points.max(axis=0)
        middle, width = 0.5 * (low + high), np.where(high > low, high - low, 1.0)
        errors, residuals = np.asarray(errors, float), np.maximum(residuals, _LEAST)
        good = np.isfinite(errors) & np.isfinite(residuals) & (errors > 0.0)
        constant, slope = np.nan, np.zeros(points.shape[1])
        if good.any():
            told = np.log(errors[good] / residuals[good])
            x = (points[good] - middle) / width
            centred = x - x.mean(axis=0)
            square = centred.T @ centred + _STIFFNESS * np.eye(len(slope))
            slope = np.linalg.solve(square, centred.T @ (told - told.mean()))
            constant = told.mean() - x.mean(axis=0) @ slope
        return cls(*map(jnp.asarray, (middle, width, np.asarray(constant), slope)))

    @classmethod
    def none(cls, names: int) -> Self:
        """One of residuals themselves."""
        zero = np.zeros(names)
        return cls(*map(jnp.asarray, (zero, zero + 1.0, np.zeros(()), zero)))

    @property
    def known(self) -> bool:
        """Whether any run tells."""
        return bool(np.isfinite(self.constant))

    def times(self, factor: float) -> Self:
        """The same, larger by a factor."""
        return eqx.tree_at(lambda c: c.constant, self, self.constant + np.log(factor))

    def __call__(self, point: Float[Array, " names"]) -> Float[Array, ""]:
        x = (point - self.middle) / self.width
        return jnp.exp(self.constant + jnp.clip(x, -_FARTHEST, _FARTHEST) @ self.slope)
