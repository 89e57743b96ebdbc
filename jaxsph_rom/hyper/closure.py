"""A linear closure of the quadratic system, learnt through its trajectories."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optax
from jax import lax
from jaxtyping import Array, Float

from jaxsph.integrate import rk4_step

from .quadratic_system import QuadraticSystem

_REPORTS = 20  # of progress in a training


class ProjectedRun(NamedTuple):
    """A full run in reduced coordinates: what a closure learns from.

    Args:
        viscosity: nu [m^2/s].
        coordinates: of its snapshots, at even intervals (S, M).
    """

    viscosity: float
    coordinates: Float[np.ndarray, "snapshots modes"]


class FittedClosure(NamedTuple):
    """A closed system and how its training went.

    Args:
        system: with the closure in its linear part.
        training, validation: loss at each report; validation is None without a held-back run.
    """

    system: QuadraticSystem
    training: list[float]
    validation: list[float] | None


def rollout(
    system: QuadraticSystem,
    coordinates: Float[Array, " modes"],
    viscosity: Float[Array, ""],
    time_step: float,
    steps_per_snapshot: int,
    snapshots: int,
) -> Float[Array, "snapshots modes"]:
    """Coordinates after each interval, by RK4; pure, and differentiable in all arrays."""

    start = jnp.zeros((), coordinates.dtype)  # the system does not depend on time

    def step(a, _):
        return rk4_step(lambda _, a: system(a, viscosity), start, a, time_step), None

    def interval(a, _):
        a, _ = lax.scan(step, a, None, length=steps_per_snapshot)
        return a, a

    return lax.scan(interval, coordinates, None, length=snapshots)[1]


def fit_linear_closure(
    system: QuadraticSystem,
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
    """The system with a linear correction, explicit in the viscosity:

        da/dt = f(a, nu) + (A + nu / nu_m A') a,

    trained by Adam with a cosine decay on the loss

        sum |a - a_run|^2 / sum |a_run|^2 + regularisation (|A|^2 + |A'|^2)

    over windows of each run that overlap by half, every window starting from the run's own
    coordinates. In the energy product the loss is an energy. nu_m is the runs' mean viscosity.

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
    mean = float(np.mean([run.viscosity for run in runs]))
    starts, wanted, viscosities = _windows(runs, window)
    dtype = system.linear.dtype
    size = jnp.mean(wanted**2)

    def closed(correction):
        change = jnp.stack([correction[0], correction[1] / mean])
        return eqx.tree_at(lambda s: s.linear, system, system.linear + change)

    def error(correction, starts, wanted, viscosities):
        def one(start, viscosity):
            return rollout(
                closed(correction), start, viscosity, time_step, steps_per_snapshot, wanted.shape[1]
            )

        return jnp.mean((jax.vmap(one)(starts, viscosities) - wanted) ** 2)

    def loss(correction):
        own = regularisation * jnp.sum(correction**2)
        return error(correction, starts, wanted, viscosities) / size + own

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
        alone = _windows([held_back], len(held_back.coordinates) - 1)
        return error(correction, *alone) / jnp.mean(alone[1] ** 2)

    every = max(1, iterations // _REPORTS)
    correction = jnp.zeros((2, system.size, system.size), dtype)
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


def _windows(runs: Sequence[ProjectedRun], window: int) -> tuple[Array, Array, Array]:
    """First coordinates, those that follow, and viscosity of every window."""
    starts, wanted, viscosities = [], [], []
    for run in runs:
        last = len(run.coordinates) - 1 - window
        for first in sorted({*range(0, last + 1, max(1, window // 2)), last}):
            starts.append(run.coordinates[first])
            wanted.append(run.coordinates[first + 1 : first + 1 + window])
            viscosities.append(run.viscosity)
    return jnp.asarray(np.stack(starts)), jnp.asarray(np.stack(wanted)), jnp.asarray(viscosities)


def _check(system: QuadraticSystem, runs: Sequence[ProjectedRun], window: int) -> None:
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
