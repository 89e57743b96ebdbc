"""A cubic system learnt from projected runs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from jaxsph.compiled import full_precision
from jaxsph.integrate import rk4_step

from .cubic_system import CubicSystem
from .inputs import Inputs
from .label_system import LabelSystem
from .products import products

_EDGE = 3  # snapshots at both ends that a filter and a difference spoil
SNAPSHOTS = 2 * _EDGE + 5  # the fewest that rates are learnt from
_RIDGES = (1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3)  # of the products' mean squares
_RECOVERY_RIDGE = 1e-6
STEPS = 2  # of RK4 from snapshot to snapshot
_ITERATIONS = 30
_STAY = 1e-6  # how much weights cost that leave those of the rates
_DONE = 1e-4  # relative change of the error that ends the iteration
_DAMPING = (1e-3, 0.2, 8.0)  # at first, after a good step, after a bad one


class LabelRun(NamedTuple):
    """A full run in reduced coordinates.

    Args:
        values: theta.
        start: coordinates of its scene's start (M,).
        coordinates: of its snapshots, without sound (S, M).
        others: what is to be recovered beside them (S, R).
    """

    values: Float[np.ndarray, " coefficients"]
    start: Float[np.ndarray, " modes"]
    coordinates: Float[np.ndarray, "snapshots modes"]
    others: Float[np.ndarray, "snapshots recovered"]


class Learnt(NamedTuple):
    """A system, and how it was learnt.

    Args:
        system: of the coordinates.
        rate_error: relative root mean square of what the rates' fit leaves, each coordinate (M,).
        before, after: relative root mean square error of the roll-outs of all runs, before and
            after they were fitted.
    """

    system: CubicSystem
    rate_error: list[float]
    before: float
    after: float

    def told(self) -> dict[str, Any]:
        """For the record."""
        return {
            "products": self.system.weights.shape[1],
            "rate_error": self.rate_error,
            "error_by_rates": self.before,
            "error": self.after,
        }


def learn(runs: Sequence[LabelRun], inputs: Inputs, interval: float) -> Learnt:
    """W and D of a `CubicSystem`.

    First the rates of the projected runs are fitted, da/dt by central differences of sixth order:

        W_0 = argmin sum |W m(a, p) - da/dt|^2 + ridge |W|^2,

    each product in its own size, with the ridge that follows the runs best; then the runs
    themselves, by Gauss-Newton steps (Levenberg, Marquardt) from W_0,

        W = argmin sum_runs int |a_W(t) - a(t)|^2 dt / int |a|^2 dt,

    a_W from the scene's start by RK4: a wave's phase is what ten periods ask for, and an error of
    the rates that is small adds up. D is fitted as W_0 is.

    Args:
        runs: all with the same times.
        inputs: of the scenes.
        interval: from snapshot to snapshot [s].

    Raises:
        ValueError: for fewer than eleven snapshots, or if no ridge gives a system that stays
            bounded on the runs.
    """
    known, size = _known(runs, inputs, interval)
    rates = np.concatenate([_rates(np.asarray(r.coordinates, float), interval) for r in runs])
    recovery = _recovery(runs, known, size)
    roll_outs = _RollOuts.of(runs, interval)
    tried = [_fitted(known / size, rates, ridge) for ridge in _RIDGES]
    dtype = runs[0].coordinates.dtype
    start, found, sizes = (jnp.asarray(a, dtype) for a in (tried[0], recovery, size))
    unlearnt = CubicSystem(weights=start, recovery=found, inputs=inputs)
    errors = [roll_outs.error(_weighted(unlearnt, sizes, jnp.asarray(w, dtype))) for w in tried]
    before, first = min(zip(errors, tried, strict=True), key=lambda pair: _finite(pair[0]))
    if not np.isfinite(before):
        raise ValueError(
            f"modes: no system of {len(first)} of them stays bounded on the training runs; take "
            "fewer modes, or more runs."
        )
    weights, after = roll_outs.refined(unlearnt, sizes, jnp.asarray(first, dtype))
    left = known @ (first / size).T - rates
    error = np.sqrt((left**2).mean(axis=0) / (rates**2).mean(axis=0))
    system = _weighted(unlearnt, sizes, weights)
    return Learnt(system, [float(e) for e in error], before, after)


def error_on(system: LabelSystem, runs: Sequence[LabelRun], interval: float) -> float:
    """Relative root mean square error of the roll-outs of runs."""
    return _RollOuts.of(runs, interval).error(system)


def _weighted(system: CubicSystem, sizes, weights) -> CubicSystem:
    return eqx.tree_at(lambda s: s.weights, system, weights / sizes[None, :])


def recover(
    runs: Sequence[LabelRun], inputs: Inputs, interval: float
) -> Float[np.ndarray, "recovered products"]:
    """D of a `LabelSystem`, by least squares from runs with a snapshot in every interval [s].

    Raises:
        ValueError: for fewer than eleven snapshots.
    """
    return _recovery(runs, *_known(runs, inputs, interval))


def _recovery(runs, known, size):
    others = np.concatenate([np.asarray(r.others[_EDGE:-_EDGE], float) for r in runs])
    return _fitted(known / size, others, _RECOVERY_RIDGE) / size


def _known(runs, inputs, interval):
    """Products of all runs, without the ends, and their sizes."""
    count = len(runs[0].coordinates)
    if count < SNAPSHOTS:
        raise ValueError(f"runs: {count} snapshots; rates need {SNAPSHOTS}. Record more often.")
    times = interval * np.arange(count)
    features = (_features(inputs, r.coordinates, times, r.values) for r in runs)
    known = np.concatenate([np.asarray(f, float)[_EDGE:-_EDGE] for f in features])
    size = np.sqrt((known**2).mean(axis=0))
    return known, np.where(size > 0.0, size, 1.0)


def _finite(error: float) -> float:
    return error if np.isfinite(error) else np.inf


@eqx.filter_jit
@full_precision
def _features(inputs, coordinates, times, values):
    times, values = (jnp.asarray(a, coordinates.dtype) for a in (times, values))
    each = jax.vmap(lambda t, a: products(a, inputs(t, values)))
    return each(times, jnp.asarray(coordinates))


def _rates(coordinates: np.ndarray, interval: float) -> np.ndarray:
    """Central differences of sixth order, without the ends."""
    a, edge, count = coordinates, _EDGE, len(coordinates)

    def away(k):
        return a[edge + k : count - edge + k] - a[edge - k : count - edge - k]

    return (45.0 * away(1) - 9.0 * away(2) + away(3)) / (60.0 * interval)


def _fitted(features: np.ndarray, wanted: np.ndarray, ridge: float) -> np.ndarray:
    squares = features.T @ features / len(features) + ridge * np.eye(features.shape[1])
    return np.linalg.solve(squares, features.T @ wanted / len(features)).T


class _RollOuts(eqx.Module):
    """Runs of a system from the starts of all full runs, beside these."""

    starts: Float[Array, "runs modes"]
    values: Float[Array, "runs coefficients"]
    wanted: Float[Array, "runs snapshots modes"]
    interval: Float[Array, ""]

    @classmethod
    def of(cls, runs: Sequence[LabelRun], interval: float):
        stacked = (np.stack([getattr(r, n) for r in runs]) for n in ("start", "values"))
        wanted = np.stack([r.coordinates for r in runs])
        return cls(*(jnp.asarray(a, wanted.dtype) for a in (*stacked, wanted, interval)))

    def error(self, system: LabelSystem) -> float:
        return float(jnp.linalg.norm(self.residual(system)))

    @eqx.filter_jit
    @full_precision
    def residual(self, system: LabelSystem) -> Float[Array, " numbers"]:
        step = self.interval / STEPS

        def run(start, values):
            def one(a, k):
                time = step * k.astype(step.dtype)
                return rk4_step(lambda t, a: system.rates(t, a, values), time, a, step), None

            def interval(a, first):
                a, _ = lax.scan(one, a, first + jnp.arange(STEPS))
                return a, a

            firsts = STEPS * jnp.arange(self.wanted.shape[1] - 1)
            return lax.scan(interval, start, firsts)[1]

        off = jax.vmap(run)(self.starts, self.values) - self.wanted[:, 1:]
        squares = jnp.sum(self.wanted[:, 1:] ** 2, axis=(1, 2), keepdims=True)
        return (off / jnp.sqrt(squares * len(self.wanted))).reshape(-1)

    @eqx.filter_jit
    @full_precision
    def _jacobian(self, system, sizes, weights):
        def residual(row):
            return self.residual(_weighted(system, sizes, row.reshape(weights.shape)))

        return jax.jacfwd(residual)(weights.reshape(-1))

    def refined(
        self, system: CubicSystem, sizes: Float[Array, " products"],
        first: Float[Array, "modes products"],
    ) -> tuple[Array, float]:  # fmt: skip
        """Weights, in the sizes of the products, after Gauss-Newton steps from the first, and the
        error then."""

        def cost(off, weights):
            return float(off @ off + _STAY * jnp.sum((weights - first) ** 2))

        def residual(weights):
            return self.residual(_weighted(system, sizes, weights))

        weights, off = first, residual(first)
        least, (damping, better, worse) = cost(off, weights), _DAMPING
        slope = self._jacobian(system, sizes, weights)
        for _ in range(_ITERATIONS):
            squares = slope.T @ slope + _STAY * jnp.eye(slope.shape[1], dtype=slope.dtype)
            down = slope.T @ off + _STAY * (weights - first).reshape(-1)
            change = jnp.linalg.solve(squares + damping * jnp.diag(jnp.diag(squares)), down)
            tried = weights - change.reshape(weights.shape)
            found = residual(tried)
            reached = cost(found, tried)
            if not reached < least:  # nor a NaN
                damping *= worse
                continue
            gained, weights, off, least = 1.0 - reached / least, tried, found, reached
            if gained < _DONE:
                break
            damping, slope = damping * better, self._jacobian(system, sizes, weights)
        return weights, float(jnp.linalg.norm(off))
