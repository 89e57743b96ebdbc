"""Single members of a prediction as trajectory files."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from jaxsph import ParticleState, Schedule, Trajectory, simulate
from jaxsph.io import TrajectoryWriter

from ..prediction.prediction import Prediction
from ..prediction.tracer_model import TracerModel, TracerState
from ..prediction.trained_model import TrainedModel


@dataclass(frozen=True)
class _Recorded:
    """What a trajectory file tells of its run."""

    name: str
    parameters: dict[str, Any]
    schedule: Schedule
    state: ParticleState
    effects: tuple[()] = ()  # a reduced model has none
    mass: None = None  # what points and tracers stand for differs from run to run


def write_fields(
    path: str | os.PathLike, trained: TrainedModel, prediction: Prediction, member: int
) -> None:
    """Write a member's fields at the reference points, as far as it is good."""
    fields = trained.fields(prediction, member)
    state = ParticleState(fields.position[0], fields.velocity[0], fields.density[0])
    with _created(path, trained, prediction, member, state) as writer:
        for k, time in enumerate(fields.time):
            step = k * trained.schedule.steps_per_snapshot
            writer.append(step, float(time), fields.snapshot(k))
        if prediction.status[member] == 0:
            writer.finish()


def write_tracers(
    path: str | os.PathLike,
    trained: TrainedModel,
    prediction: Prediction,
    member: int,
    positions: Float[np.ndarray, "particles dim"],
    progress: Callable[[int], None] | None = None,
) -> Trajectory:
    """Run a member again with tracers in its flow, and write these.

    Raises:
        SimulationError: on a fault; the file then holds the good snapshots.
    """
    dtype = trained.flow.reference.points.dtype
    values = jnp.asarray(prediction.values[member], dtype)
    model = TracerModel.of(trained.flow, values, trained.functional.walls)
    model = eqx.tree_at(lambda m: m.fluid, model, trained.fluid(values))
    start = TracerState(
        jnp.asarray(prediction.coordinates[member, 0], dtype), jnp.asarray(positions, dtype)
    )
    first = eqx.filter_jit(lambda model, state: model.observe(state))(model, start)
    state = ParticleState(first.position, first.velocity, first.density)
    with _created(path, trained, prediction, member, state) as writer:
        run = simulate(
            model,
            start,
            _schedule(trained, prediction),
            recorder=writer,
            progress=progress,
            metadata={"scene": trained.scene, "tracers": True},
        )
        writer.finish(run.metadata)
    return run


def _created(path, trained, prediction, member, state) -> TrajectoryWriter:
    parameters = {
        **trained.parameters,
        **{name: float(values[member]) for name, values in prediction.parameters.items()},
        "end_time": float(prediction.time[-1]),
        "reduced": {"modes": trained.flow.basis.size, **trained.training},
        "outside": bool(prediction.outside[member]),
        "error_indicator": float(prediction.error_indicator[member]),
    }
    run = _Recorded(trained.scene, parameters, _schedule(trained, prediction), state)
    return TrajectoryWriter.create(path, run, modes=trained.flow.basis.size, overwrite=True)


def _schedule(trained, prediction) -> Schedule:
    return replace(trained.schedule, intervals=len(prediction.time) - 1)
