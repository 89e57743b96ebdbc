"""Samples by column-pivoted QR: the discrete empirical interpolation method."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np
import scipy.linalg

from .base import Chosen, Sampling, check, scaled


@final
@dataclass(frozen=True)
class QDEIM(Sampling):
    """Rates from those at the samples by least squares in their own modes D:

        B = Phi^T W D (D_P)^+.

    The points P are those of the first pivots of the QR of (W^1/2 D)^T (Drmac and Gugercin 2016,
    A new selection operator for the discrete empirical interpolation method). As a sample has all
    its fields, there are more equations than modes. Where pivots share points, more are added one
    by one, each where the direction that the samples see least is largest (Peherstorfer, Drmac and
    Gugercin 2020, Stability of discrete empirical interpolation and gappy proper orthogonal
    decomposition, GappyPOD+E to leading order).

    Args:
        samples: how many points.
        modes: of D; as many as samples, or all there are, if none is given.
    """

    samples: int
    modes: int | None = None

    def choose(self, basis, rates):
        check(self.samples, basis, rates)
        available = min(rates.size, self.samples * rates.modes.shape[1])
        modes = min(self.samples, rates.size) if self.modes is None else self.modes
        if not 1 <= modes <= available:
            raise ValueError(
                f"modes: {modes} of the rates asked for, but {self.samples} samples of "
                f"{rates.size} modes carry 1 to {available}; ask for fewer, or more samples."
            )
        phi, dee = scaled(basis), scaled(rates)[:, :, :modes]
        points = _selected(dee, self.samples)
        count = len(points)
        seen = dee[points].reshape(-1, modes)
        projected = np.einsum("gfm,gfk->mk", phi, dee)
        gather = scipy.linalg.lstsq(seen.T, projected.T)[0].T  # B seen = projected, least norm
        return Chosen(points, gather.reshape(-1, count, dee.shape[1]) * _root(basis))


def _selected(modes, wanted: int):
    count, fields, _ = modes.shape
    _, pivots = scipy.linalg.qr(modes.reshape(count * fields, -1).T, mode="r", pivoting=True)
    entries = pivots[: modes.shape[2]] // fields
    first = np.sort(np.unique(entries, return_index=True)[1])
    points = list(entries[first][:wanted])
    left = np.ones(count, bool)
    left[points] = False
    gram = np.einsum("pfk,pfl->kl", modes[points], modes[points])
    while len(points) < wanted:
        least = scipy.linalg.eigh(gram, subset_by_index=(0, 0))[1][:, 0]
        seen = np.where(left, np.sum((modes @ least) ** 2, axis=1), -1.0)
        points.append(int(np.argmax(seen)))
        left[points[-1]] = False
        gram += modes[points[-1]].T @ modes[points[-1]]
    return np.asarray(points)


def _root(basis):
    return np.sqrt(np.asarray(basis.weights))[None, None, :]
