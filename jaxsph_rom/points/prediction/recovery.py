"""Velocity and pressure of a flow whose modes are solenoidal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import scipy.linalg
from jaxtyping import Array, Float

if TYPE_CHECKING:
    from ..training.closure import ProjectedRun

_STRENGTHS = 10.0 ** np.arange(-8.0, 1.0)  # of the regularisation, tried in turn
_BLOCKS = 5  # into which a single run is cut


class Recovery(eqx.Module):
    """Fields from the coordinates a of solenoidal velocity modes:

        u = sum_m a_m V_m,    r = R + sum_k b_k Psi_k,    b = C + L a + Q(a, a).

    Without sound the pressure is a function of the velocity at the time, by its Poisson equation
    div grad p = -rho div (u . grad u) quadratic but for the part that viscosity adds at walls. V
    are the mapped fields themselves that belong to the coordinates, with the divergence that the
    modes have lost.

    Args:
        velocity: V (G, n, M).
        mean: R, the mean logarithmic density (G,).
        modes: Psi of the logarithmic density (G, K).
        constant, linear, quadratic: C (K,), L (K, M), Q (K, M, M).
    """

    velocity: Float[Array, "points dim modes"]
    mean: Float[Array, " points"]
    modes: Float[Array, "points density_modes"]
    constant: Float[Array, " density_modes"]
    linear: Float[Array, "density_modes modes"]
    quadratic: Float[Array, "density_modes modes modes"]

    @property
    def functions(self) -> Float[np.ndarray, "points functions"]:
        """What is carried to other points."""
        velocity = np.asarray(self.velocity).reshape(len(self.velocity), -1)
        return np.concatenate([velocity, self.modes, np.asarray(self.mean)[:, None]], axis=1)

    def combination(
        self, coordinates: Float[Array, " modes"]
    ) -> tuple[Float[Array, "functions fields"], Float[Array, "1 fields"]]:
        """Two matrices: fields (r, u) = functions @ first + second."""
        dim = self.velocity.shape[1]
        b = self.constant + (self.linear + self.quadratic @ coordinates) @ coordinates
        of_density = jnp.append(b, jnp.ones_like(b[:1]))[:, None]
        each = jnp.eye(dim, dtype=coordinates.dtype)
        of_velocity = jnp.einsum("de,m->dme", each, coordinates).reshape(-1, dim)
        upper = jnp.pad(of_velocity, ((0, 0), (1, 0)))
        lower = jnp.pad(of_density, ((0, 0), (0, dim)))
        return jnp.concatenate([upper, lower]), jnp.zeros((1, 1 + dim), coordinates.dtype)


def fit_recovery(
    fields: Sequence[Float[np.ndarray, "points fields times"]],
    projected: Sequence[ProjectedRun],
    predicted: Sequence[Float[np.ndarray, "times modes"]],
    density_modes: int,
    first: int = 0,
) -> Recovery:
    """A recovery learnt from full runs.

    V is the least-squares map from the runs' own coordinates to their velocities. C, L and Q are
    found by ridge regression from the coordinates that the reduced model itself predicts for these
    runs, so that its own errors do not count twice; the strength is the one that does best on runs
    left out one by one (on blocks of time of a single run).

    Args:
        fields: (r, u) of each run on the reference points.
        projected: the same runs in coordinates.
        predicted: their coordinates by the reduced model.
        density_modes: K; fewer where the snapshots do not give so many.
        first: number of the first snapshot that pressure is learnt from.

    Raises:
        ValueError: if no snapshot is left.
    """
    points, count, _ = fields[0].shape
    own = np.concatenate([run.coordinates for run in projected])
    velocity = np.concatenate([f[:, 1:].reshape(points * (count - 1), -1) for f in fields], axis=1)
    lift = scipy.linalg.lstsq(own, velocity.T)[0].T
    late = [f[:, 0, first:] for f in fields]
    if not sum(f.shape[1] for f in late):
        raise ValueError(f"first: no snapshot is left from number {first} on; begin earlier.")
    density = np.concatenate(late, axis=1)
    mean = density.mean(axis=1)
    left, sigma, right = scipy.linalg.svd(density - mean[:, None], full_matrices=False)
    kept = min(density_modes, int(np.count_nonzero(sigma > 1e-10 * sigma[0])))
    targets = (sigma[:kept, None] * right[:kept]).T
    a = np.concatenate([p[first:] for p in predicted])
    groups = np.repeat(np.arange(len(late)), [f.shape[1] for f in late])
    if len(late) == 1:
        groups = np.arange(len(a)) * _BLOCKS // len(a)
    pairs = np.triu_indices(a.shape[1])
    features = np.concatenate([a, a[:, pairs[0]] * a[:, pairs[1]]], axis=1)
    strength = _best_strength(features, targets, groups)
    constant, weights = _ridge(features, targets, strength)
    size = a.shape[1]
    quadratic = np.zeros((kept, size, size))
    quadratic[:, pairs[0], pairs[1]] = weights[size:].T
    quadratic = 0.5 * (quadratic + np.swapaxes(quadratic, 1, 2))
    dtype = fields[0].dtype
    return Recovery(*(
        jnp.asarray(value, dtype)
        for value in (
            lift.reshape(points, count - 1, -1), mean, left[:, :kept], constant,
            weights[:size].T, quadratic,
        )
    ))  # fmt: skip


def _best_strength(features, targets, groups) -> float:
    """The strength whose fit to all groups but one is nearest to that one, summed over all."""

    def error(strength):
        total = 0.0
        for group in np.unique(groups):
            out = groups == group
            constant, weights = _ridge(features[~out], targets[~out], strength)
            total += np.sum((constant + features[out] @ weights - targets[out]) ** 2)
        return total

    return min(_STRENGTHS, key=error)


def _ridge(features, targets, strength):
    """Constant and weights of the features, each of these measured in its own spread."""
    mean, spread = features.mean(axis=0), features.std(axis=0)
    spread = np.where(spread > 0.0, spread, 1.0)
    centre = targets.mean(axis=0)
    left, sigma, right = scipy.linalg.svd((features - mean) / spread, full_matrices=False)
    shrunk = sigma / (sigma**2 + strength * len(features))
    weights = right.T @ (shrunk[:, None] * (left.T @ (targets - centre))) / spread[:, None]
    return centre - mean @ weights, weights
