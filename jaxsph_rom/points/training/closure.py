"""A linear closure of reduced dynamics, learnt through their trajectories."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optax
from jax import lax
from jaxtyping import Array, Float

from jaxsph.integrate import rk4_step

from ..dynamics.base import Closable

_REPORTS = 20  # of progress in a training


class ProjectedRun(NamedTuple):
    """A full run in reduced coordinates: what a closure learns from.

    Args:
        values: theta of the operators; a viscosity [m^2/s], say.
        coordinates: of its snapshots, at even intervals from time 0 on (S, M).
    """

    values: float | Float[np.ndarray, " coefficients"]
    coordinates: Float[np.ndarray, "snapshots modes"]


class FittedClosure(NamedTuple):
    """A closed system and how its training went.

    Args:
        system: with the closure in its linear part.
        training, validation: loss at each report; validation is None without a held-back run.
    """

    system: Closable
    training: list[float]
    validation: list[float] | None


def rollout(
    system: Closable,
    coordinates: Float[Array, " modes"],
    values: Float[Array, "*coefficients"],
    time_step: float,
    steps_per_snapshot: int,
    snapshots: int,
    first: Float[Array, ""] | float = 0.0,
) -> Float[Array, "snapshots modes"]:
    """Coordinates after each interval from time `first` [s] on, by RK4; pure, and differentiable in
    all arrays."""

    def step(carry, _):
        time, a = carry
        a = rk4_step(lambda t, a: system.rates(t, a, values), time, a, time_step)
        return (time + time_step, a), None

    def interval(carry, _):
        carry, _ = lax.scan(step, carry, None, length=steps_per_snapshot)
        return carry, carry[1]

    start = jnp.asarray(first, coordinates.dtype)
    return lax.scan(interval, (start, coordinates), None, length=snapshots)[1]


def fit_linear_closure(
    system: Closable,
    runs: Sequence[ProjectedRun],
    time_step: float,
    steps_per_snapshot: int,
    *,
    held_back: ProjectedRun | None = None,
    window: int = 50,
    iterations: int = 600,
    learning_rate: float = 0.02,
    regularisation: float = 1e-8,
    progress: Callable[[int], None] | None = None,
) -> FittedClosure:
    """The system with a linear correction, explicit in its coefficients:

        da/dt = f(a; theta) + (A + sum_k theta_k / s_k A_k) a,

    trained by Adam with a cosine decay on the loss

        sum |a - a_run|^2 / sum |a_run|^2 + regularisation (|A|^2 + sum |A_k|^2)

    over windows of each run that overlap by half, every window starting from the run's own
    coordinates. In the energy product the loss is an energy. s_k is the runs' mean |theta_k|, the
    mean viscosity, say.

    Args:
        system: as projected.
        runs: to learn from.
        time_step: of the reduced model [s].
        steps_per_snapshot: between two snapshots of the runs.
        held_back: another run; the iteration that does best on it is kept, at its full length.
        window: intervals between snapshots in a window.
        iterations: of Adam.
        learning_rate: at the start.
        regularisation: weight of the correction's own size [s^2].
        progress: is called with the number of iterations done since its last call.

    Raises:
        ValueError: if there is no run, one differs from the system in its modes, or is shorter
            than the window; if the training diverges.
    """
    _check(system, runs if held_back is None else [*runs, held_back], window)
    interval = time_step * steps_per_snapshot
    mean = np.mean([np.abs(np.atleast_1d(run.values)) for run in runs], axis=0)
    examples = _windows(runs, window, interval)
    wanted = examples[1]
    dtype = wanted.dtype
    scale = jnp.asarray(np.where(mean > 0.0, mean, 1.0), dtype)[:, None, None]
    size = jnp.mean(wanted**2)

    def closed(correction):
        return system.plus(correction[0], correction[1:] / scale)

    def error(correction, starts, wanted, values, times):
        model = closed(correction)

        def one(start, values, time):
            return rollout(
                model, start, values, time_step, steps_per_snapshot, wanted.shape[1], time
            )

        return jnp.mean((jax.vmap(one)(starts, values, times) - wanted) ** 2)

    def loss(correction):
        own = regularisation * jnp.sum(correction**2)
        return error(correction, *examples) / size + own

    optimiser = optax.adam(optax.cosine_decay_schedule(learning_rate, iterations))

    @jax.jit
    def improve(correction, state):
        def step(carry, _):
            correction, state = carry
            value, slope = jax.value_and_grad(loss)(correction)
            with jax.numpy_dtype_promotion("standard"):  # optax mixes its dtypes
                change, state = optimiser.update(slope, state)
            return (optax.apply_updates(correction, change), state), value

        carry, values = lax.scan(step, (correction, state), None, length=every)
        return carry, values[-1]

    @jax.jit
    def judge(correction):
        alone = _windows([held_back], len(held_back.coordinates) - 1, interval)
        return error(correction, *alone) / jnp.mean(alone[1] ** 2)

    every = max(1, iterations // _REPORTS)
    correction = jnp.zeros((1 + len(mean), system.size, system.size), dtype)
    state = optimiser.init(correction)
    best, training, validation = correction, [], []
    for _ in range(-(-iterations // every)):
        (correction, state), value = improve(correction, state)
        training.append(float(value))
        if held_back is not None:
            validation.append(float(judge(correction)))
            if np.isfinite(validation[-1]) and validation[-1] <= np.nanmin(validation):
                best = correction
        if progress is not None:
            progress(every)
    if not np.isfinite(training).all():
        raise ValueError(
            "closure: the loss is not finite; lower the learning rate or shorten the window."
        )
    if held_back is None:
        return FittedClosure(closed(correction), training, None)
    return FittedClosure(closed(best), training, validation)


def _windows(
    runs: Sequence[ProjectedRun], window: int, interval: float
) -> tuple[Array, Array, Array, Array]:
    """First coordinates, those that follow, coefficients and first time of every window."""
    starts, wanted, values, times = [], [], [], []
    for run in runs:
        last = len(run.coordinates) - 1 - window
        for first in sorted({*range(0, last + 1, max(1, window // 2)), last}):
            starts.append(run.coordinates[first])
            wanted.append(run.coordinates[first + 1 : first + 1 + window])
            values.append(np.atleast_1d(run.values))
            times.append(first * interval)
    stacked = (np.stack(starts), np.stack(wanted), np.stack(values), np.asarray(times))
    return tuple(jnp.asarray(part, stacked[0].dtype) for part in stacked)


def _check(system: Closable, runs: Sequence[ProjectedRun], window: int) -> None:
    if not runs:
        raise ValueError("runs: a closure needs at least one run to learn from.")
    for run in runs:
        count, modes = run.coordinates.shape
        if modes != system.size:
            raise ValueError(
                f"runs: one has {modes} modes, the system {system.size}; project it on the same "
                "basis."
            )
        if count <= window:
            raise ValueError(
                f"window: {window} intervals, but a run has {count} snapshots; shorten it."
            )
