"""What the inverse problems share: noisy probes, runs that name their faults, and descent."""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optax
from jaxtyping import Array, Float

from jaxsph import COMPILER_OPTIONS, FullModel, ParticleState, Snapshot, Space
from jaxsph.integrate import FaultCode, explanation, integrate
from jaxsph.interpolation import KernelMap, ShepardMap
from jaxsph.scenes import Scene

from ..measure import progress


class Descent(NamedTuple):
    """How an optimisation went.

    Args:
        best: parameters with the least loss.
        losses: before each step, and after the last.
        history: parameters at these.
        evaluations: of the loss with its gradient, those of line searches with them.
        seconds: of all steps, without compilation.
        compile_seconds: before the first.
    """

    best: Any
    losses: list[float]
    history: list[Any]
    evaluations: int
    seconds: float
    compile_seconds: float


def run(
    scene: Scene, model: FullModel, state: ParticleState | None = None
) -> tuple[Snapshot, Array]:
    """Snapshots of a scene's run, without the start, and its fault's code; to differentiate."""
    state = scene.state if state is None else state
    _, fault, snapshots, _ = integrate(
        model,
        state,
        jnp.zeros((), jnp.int32),
        jnp.asarray(scene.time_step, state.density.dtype),
        scene.steps_per_snapshot,
        scene.schedule.intervals,
    )
    return snapshots, fault.code


def grid(space: Space, side: int) -> Float[np.ndarray, "probes 2"]:
    """Probes [m] on a square grid over a box of two dimensions."""
    ticks = [
        a + b * (np.arange(side) + 0.5) / side
        for a, b in zip(space.box.lower, space.box.lengths, strict=True)
    ]
    return np.stack(np.meshgrid(*ticks), axis=-1).reshape(-1, 2)


def probes_of(points, space: Space) -> Callable[[Snapshot], Float[Array, "times probes dim"]]:
    """Velocities at probes, by Shepard interpolation, of snapshots (S, ...)."""
    probe: KernelMap = ShepardMap.allocate(jnp.asarray(points), space)

    def velocity(snapshots):
        def at(snapshot):
            return probe(*snapshot)[0]

        return jax.lax.map(at, (snapshots.position, snapshots.velocity))

    return velocity


def noisy(values, share: float, seed: int = 0):
    """Values with Gaussian noise, `share` of the largest in size."""
    noise = np.random.default_rng(seed).standard_normal(values.shape)
    return jnp.asarray(values + share * np.abs(values).max() * noise)


def descend(
    loss: Callable[[Any], tuple[Array, Array]],
    start: Any,
    optimiser: optax.GradientTransformation,
    steps: int,
    label: str,
) -> Descent:
    """Least loss over steps of an optimiser of optax.

    Args:
        loss: parameters -> (loss, fault's code of the run in it).
        start: parameters.
        optimiser: with or without a line search.
        steps: of it.
        label: of the progress bar.

    Raises:
        ValueError: if a run meets a fault, or the loss is not finite.
    """
    optimiser = optax.with_extra_args_support(optimiser)

    @jax.jit
    def step(parameters, state):
        (value, code), slope = jax.value_and_grad(loss, has_aux=True)(parameters)
        with jax.numpy_dtype_promotion("standard"):  # optax mixes its dtypes
            change, state = optimiser.update(
                slope, state, parameters, value=value, grad=slope, value_fn=lambda p: loss(p)[0]
            )
        return value, code, optax.apply_updates(parameters, change), state

    parameters, state = start, optimiser.init(start)
    before = clock.perf_counter()
    step_now = step.lower(parameters, state).compile(COMPILER_OPTIONS)
    compile_seconds = clock.perf_counter() - before
    losses, history, evaluations = [], [start], 0
    before = clock.perf_counter()
    with progress(label, steps) as report:
        for number in range(steps + 1):
            value, code, following, state = step_now(parameters, state)
            if int(code) != FaultCode.NONE:
                raise ValueError(f"{label}: step {number}: {explanation(int(code))}.")
            if not np.isfinite(value):
                raise ValueError(f"{label}: the loss is not finite after {number} steps.")
            losses.append(float(value))
            if number < steps:
                parameters = following
                history.append(parameters)
                searched = optax.tree_utils.tree_get(state, "num_linesearch_steps")
                evaluations += 1 + (0 if searched is None else int(searched))
                report(1)
    seconds = clock.perf_counter() - before
    best = history[int(np.argmin(losses))]
    return Descent(best, losses, history, evaluations, seconds, compile_seconds)
