"""Samples with non-negative weights: energy-conserving sampling and weighting."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np
import scipy.linalg

from .base import Chosen, Sampling, check, scaled


@final
@dataclass(frozen=True)
class NonNegativeWeights(Sampling):
    """Sums over all points as weighted sums over a few, ECSW (Farhat, Chapman and Avery 2015):

        B = Phi_P^T W diag(xi),    xi >= 0 from    min || C xi - C 1 ||,
        C_(m,k),g = s_k sum_f Phi_gfm w_f D_gfk.

    D and s are modes and singular values of the rates: the columns of s D are the training rates
    but for a rotation, which the norm does not see. The minimum is approached by the method of
    Lawson and Hanson (1974), one point at a time, until there are as many as wanted or no point
    more would help. The modes are tested as they are, nothing is interpolated.

    Args:
        samples: how many points, at most.
    """

    samples: int

    def choose(self, basis, rates):
        check(self.samples, basis, rates)
        phi = scaled(basis)
        dee = scaled(rates) * np.asarray(rates.singular_values)[: rates.size]
        matrix = np.einsum("gfm,gfk->mkg", phi, dee).reshape(-1, len(phi))
        points, weights = _lawson_hanson(matrix, matrix.sum(axis=1), self.samples)
        tested = np.asarray(basis.modes)[points] * np.asarray(basis.weights)[None, :, None]
        return Chosen(points, np.moveaxis(tested, 2, 0) * weights[None, :, None])


def _lawson_hanson(matrix, wanted, most: int):
    """Non-negative least squares, stopped at `most` entries; these and their values."""
    values = np.zeros(matrix.shape[1])
    used = np.zeros(matrix.shape[1], bool)
    enough = 1e-12 * np.abs(matrix.T @ wanted).max()
    while used.sum() < most:
        slope = np.where(used, -np.inf, matrix.T @ (wanted - matrix @ values))
        best = int(np.argmax(slope))
        if slope[best] <= enough:
            break
        used[best] = True
        while True:
            points = np.flatnonzero(used)
            found = scipy.linalg.lstsq(matrix[:, points], wanted)[0]
            if np.all(found > 0.0):
                break
            held = values[points]
            falling = found <= 0.0
            share = np.min(held[falling] / (held[falling] - found[falling]))
            held = held + share * (found - held)
            held[falling & (held <= 1e-14 * held.max())] = 0.0
            values[points] = held
            used[points] = held > 0.0
        values[:] = 0.0
        values[points] = found
    points = np.flatnonzero(used)
    return points, values[points]
