"""Running a model from the host: progress, recording, timing and faults."""

from __future__ import annotations

import dataclasses
import logging
import time as clock
import warnings
from collections.abc import Callable, Sequence
from typing import Any, Protocol

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from .compiled import compiled
from .devices import Devices
from .forces_over_time import ForcesOverTime
from .integrate import (
    Fault,
    FaultCode,
    FixedSteps,
    Model,
    SimulationError,
    Stepping,
    integrate,
)
from .schedule import Schedule
from .timing import Timing
from .trajectory import Snapshot, Trajectory
from .wall_forces import WallForces

_log = logging.getLogger(__name__)
_LOADS, _MEANS = ("forces", "torques"), ("mean_forces", "mean_torques")
_ENLARGEMENTS = 8  # of the neighbour list in one run, together a factor of four


class Recorder(Protocol):
    """Takes snapshots as the run makes them (an open trajectory file, say)."""

    def append(self, step: int, time: float, snapshot: Snapshot) -> None: ...


Watch = Callable[[float, Snapshot], str | None]
Measure = Callable[[Any, jax.Array, Any], tuple[dict[str, jax.Array], dict[str, jax.Array]]]


@compiled
def _interval(model, state, first_step, time_step, steps, stepping, averaged):
    if averaged is not None:
        model = ForcesOverTime(model, averaged)
        state = model.start(state)
    state, fault, snapshots, _ = integrate(model, state, first_step, time_step, steps, 1, stepping)
    means = None if averaged is None else state.means(averaged.names, steps * time_step)
    state = state if averaged is None else state.particles
    return state, fault, jax.tree.map(lambda a: a[0], snapshots), means


def simulate(
    model: Model,
    state: Any,
    schedule: Schedule,
    *,
    first_step: int = 0,
    recorder: Recorder | None = None,
    progress: Callable[[int], None] | None = None,
    metadata: dict | None = None,
    stepping: Stepping = FixedSteps(),  # noqa: B008
    measure: Measure | None = None,
    averaged: WallForces | None = None,
    watch: Watch | None = None,
    devices: Sequence[jax.Device] | Devices | None = None,
) -> Trajectory:
    """Integrate a model and return its snapshots, the first being the state given.

    Run time excludes compilation: the first interval runs twice, once to compile. A neighbour
    list that overflows is allocated anew with a fifth more room, up to eight times, and the run
    goes on from its last snapshot, with a warning. The logger `jaxsph.simulate` is told of the
    compilation and of the end (info), and of each snapshot (debug).

    Args:
        model: full or reduced.
        state: at step `first_step`.
        schedule: of the whole run: step, snapshots, end.
        first_step: 0, or that of a snapshot where a resumed run goes on; this one is not recorded
            again.
        recorder: is given each snapshot as it is made.
        progress: is called with the number of steps done since its last call.
        metadata: kept with the trajectory, beside `steps`, `run_seconds`, `compile_seconds`.
        stepping: equal steps of dt; or `AutomaticSteps`, with intervals of the same length. By
            RK4, or another `Stepper` given to either.
        measure: model, time [s] and state of each snapshot -> forces and torques to go with it, by
            name: `jaxsph.WallForces.of(scene)`, say.
        averaged: forces on walls whose means over each interval go with the snapshot at its end:
            `ForcesOverTime`, of a full model. Those of the first are of that instant.
        watch: time [s] and each new snapshot -> why it is not to be believed, if it is not. The
            run goes on; the first such answer is a warning, and `doubt` in the metadata, with
            `doubt_time` [s].
        devices: that run a full model together, each its share of the particles and of their
            neighbours, as `jax.devices()`; results differ by rounding. One device if none are
            given. Devices of several processes (`jax.distributed`) will do, if all call this alike;
            the first of these alone tells `recorder`, and what that raises they all raise.

    Raises:
        ValueError: if no whole interval is left to run, or `devices` are given for a model that one
            device runs.
        SimulationError: on a fault; all good snapshots have gone to the recorder by then.

    Examples:
        >>> import jaxsph
        >>> from jaxsph.arrangements import Lattice
        >>> scene = jaxsph.scenes.taylor_green(resolution=16, arrangement=Lattice())
        >>> schedule = jaxsph.Schedule(scene.time_step, steps_per_snapshot=2, intervals=2)
        >>> trajectory = jaxsph.simulate(scene.model(), scene.state, schedule)
        >>> trajectory.velocity.shape  # snapshots, particles, directions
        (3, 256, 2)
    """
    time_step, each = schedule.time_step, schedule.steps_per_snapshot
    if first_step % each or first_step >= schedule.steps:
        raise ValueError(
            f"first_step: from {first_step} to {schedule.steps} must be a whole, positive number "
            f"of intervals of {each} steps."
        )
    shared = None if devices is None else Devices(devices)
    if shared is not None:
        model, state = model.over(shared), shared.placed(state)
    dtype = jax.tree.leaves(eqx.filter(state, eqx.is_inexact_array))[0].dtype
    dt = jnp.asarray(time_step, dtype)
    records, times, metadata = [], [], dict(metadata or {})

    def known(tree):
        return tree if shared is None else shared.known(tree)

    def tell(step, snapshot):
        if recorder is not None:
            recorder.append(step, step * time_step, snapshot)

    def record(step, snapshot, means=None):
        if measure is not None:
            loads = measure(model, jnp.asarray(step * time_step, dtype), state)
            snapshot = dataclasses.replace(snapshot, **dict(zip(_LOADS, loads, strict=True)))
        if averaged is not None:
            means = means or averaged(model, jnp.asarray(step * time_step, dtype), state)
            snapshot = dataclasses.replace(snapshot, **dict(zip(_MEANS, means, strict=True)))
        snapshot = jax.tree.map(np.asarray, known(snapshot))
        particle = _lost(snapshot)
        if particle is not None:
            fault = Fault(FaultCode.NOT_FINITE, step, particle)
            raise _failed(fault)
        records.append(snapshot)
        times.append(step * time_step)
        if shared is not None:
            shared.by_first(lambda: tell(step, snapshot))
        else:
            tell(step, snapshot)
        if watch is not None and "doubt" not in metadata:
            found = doubt(watch, step * time_step, snapshot)
            metadata.update(found)
            if found:
                warnings.warn("t = {doubt_time:.4g} s: {doubt}.".format(**found), stacklevel=3)

    def _failed(fault, likely=None):
        error = SimulationError(fault, time_step, likely)
        error.trajectory = trajectory() if records else None
        return error

    def trajectory():
        stacked = jax.tree.map(lambda *a: np.stack(a), *records)
        took = Timing(
            step - first_step, time_step, run_seconds, compile_seconds, tuple(enlarged_at)
        )
        return Trajectory(
            time=np.asarray(times),
            position=stacked.position,
            velocity=stacked.velocity,
            density=stacked.density,
            pressure=stacked.pressure,
            coordinates=stacked.coordinates,
            forces=stacked.forces,
            torques=stacked.torques,
            mean_forces=stacked.mean_forces,
            mean_torques=stacked.mean_torques,
            bodies=stacked.bodies,
            active=stacked.active,
            metadata={**metadata, **took.metadata()},
        )

    compile_seconds, run_seconds, step = 0.0, 0.0, first_step
    compiled, enlarged_at = False, []
    if first_step == 0:
        record(0, model.observe(state))
    while step < schedule.steps:
        start = clock.perf_counter()
        new, fault, snapshot, means = jax.block_until_ready(
            _interval(model, state, np.int32(step), dt, each, stepping, averaged)
        )
        elapsed = clock.perf_counter() - start
        if not compiled:  # this interval runs once more, for its time without compilation
            compiled, compile_seconds = True, compile_seconds + elapsed
            _log.info("compiled in %.3g s; from step %d to %d", elapsed, step, schedule.steps)
            continue
        if int(fault.code) == FaultCode.NEIGHBOR_OVERFLOW and len(enlarged_at) < _ENLARGEMENTS:
            larger = model.enlarged()
            if larger is not None:
                warnings.warn(
                    f"step {int(fault.step)}: a particle has more neighbours than the list holds; "
                    f"allocated it anew with more room and went on from step {step}.",
                    stacklevel=2,
                )
                model, compiled = larger, False
                enlarged_at.append(int(fault.step))
                continue
        if int(fault.code) != FaultCode.NONE:
            raise _failed(fault, model.likely_cause(fault, known(new), time_step))
        run_seconds += elapsed
        state, step = new, step + each
        record(step, snapshot, means)
        _log.debug("step %d, t = %.4g s", step, step * time_step)
        if progress is not None:
            progress(each)
    _log.info("%d steps in %.3g s", step - first_step, run_seconds)
    return trajectory()


def doubt(watch: Watch, time: float, snapshot: Snapshot) -> dict[str, Any]:
    """Metadata of a run with that snapshot: `doubt`, `doubt_time` if it is not to be believed."""
    why = watch(time, snapshot)
    return {} if why is None else {"doubt": why, "doubt_time": time}


def first_doubt(watch: Watch, trajectory: Trajectory) -> dict[str, Any]:
    """The first `doubt` of a trajectory's snapshots, as in metadata; empty if there is none."""
    for number, time in enumerate(trajectory.time):
        found = doubt(watch, float(time), trajectory.snapshot(number))
        if found:
            return found
    return {}


def _lost(snapshot: Snapshot) -> int | None:
    """The first particle with a field that is not finite; -1 if only coordinates or forces are
    not."""
    fields = (snapshot.position, snapshot.velocity, snapshot.density, snapshot.pressure)
    bad = np.any([~np.isfinite(a).reshape(len(a), -1).all(axis=1) for a in fields], axis=0)
    if bad.any():
        return int(np.argmax(bad))
    loads = (getattr(snapshot, name) for name in (*_LOADS, *_MEANS))
    others = jax.tree.leaves((snapshot.coordinates, *loads))
    return None if all(np.isfinite(each).all() for each in others) else -1
