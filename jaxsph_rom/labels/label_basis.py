"""Modes over labels."""

from __future__ import annotations

from typing import Self

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float, Int


class LabelBasis(eqx.Module):
    """z = c + S^-1 Phi b: modes of numbers z over labels, orthonormal in (S z)^T (S z'), with S
    diagonal and the same for a whole field: 1 over the root of its mean square about c,

        S_f^-2 = mean over snapshots of |z_f - c_f|^2,

    so that displacement and velocity count alike.

    Args:
        modes: Phi (Z, K).
        centre: c, the mean of the snapshots (Z,).
        scale: the diagonal of S (Z,).
        singular_values: of all modes.
    """

    modes: Float[np.ndarray, "numbers modes"]
    centre: Float[np.ndarray, " numbers"]
    scale: Float[np.ndarray, " numbers"]
    singular_values: Float[np.ndarray, " snapshots"]

    @classmethod
    def of(cls, snapshots: Float[np.ndarray, "times numbers"], fields: int, modes: int) -> Self:
        """POD by the method of snapshots (Sirovich 1987).

        Args:
            snapshots: rows of `fields` parts of the same length, one after the other.
            fields: how many parts.
            modes: K at most; fewer if snapshots have no more.

        Raises:
            ValueError: if a value is not finite, or a field is the same at all times.
        """
        if not np.isfinite(snapshots).all():
            raise ValueError("snapshots: a value is not finite; the full model's run has failed.")
        dtype, snapshots = snapshots.dtype, np.asarray(snapshots, float)
        centre = snapshots.mean(axis=0)
        away = snapshots - centre
        size = np.sqrt((away.reshape(len(away), fields, -1) ** 2).sum(axis=2).mean(axis=0))
        if not (size > 0.0).all():
            raise ValueError("snapshots: a field is the same at all times; record what moves.")
        scale = np.repeat(1.0 / size, snapshots.shape[1] // fields)
        away *= scale
        squares, vectors = np.linalg.eigh(away @ away.T)
        sigma = np.sqrt(np.maximum(squares[::-1], 0.0))
        # the squares are known to round-off: half the digits of the values
        noise = np.sqrt(len(away) * np.finfo(sigma.dtype).eps) * sigma[0]
        rank = int(np.count_nonzero(sigma > noise))
        count = min(modes, rank)
        phi = away.T @ (vectors[:, ::-1][:, :count] / sigma[:count])
        return cls(*(a.astype(dtype) for a in (phi, centre, scale, sigma)))

    @property
    def size(self) -> int:
        return self.modes.shape[1]

    def project(self, numbers: Float[np.ndarray, "*times numbers"]) -> Array:
        """b."""
        return ((numbers - self.centre) * self.scale) @ self.modes

    def numbers(self, coordinates: Float[np.ndarray, "*times modes"]) -> Array:
        """z."""
        return coordinates @ self.modes.T / self.scale + self.centre

    def at(self, labels: Int[np.ndarray, " labels"], fields: int, width: int) -> Self:
        """The same on some labels, where each of the fields has `width` numbers a label."""
        rows = np.arange(len(self.scale)).reshape(fields, -1, width)[:, labels].reshape(-1)
        return type(self)(
            self.modes[rows], self.centre[rows], self.scale[rows], self.singular_values
        )
