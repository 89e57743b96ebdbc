"""A reduced flow at many coefficients at once."""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh, NamedSharding, PartitionSpec
from jaxtyping import Array, Float, Int

from jaxsph import Schedule
from jaxsph.compiled import full_precision
from jaxsph.sweeps.room import Device, check_room

from ..dynamics.points_model import PointsModel
from .reduced_flow import ReducedFlow
from .times import EvenTimes, Times

_BATCH = 500  # members of a CPU; what a step touches then stays in cache
_WIDE_BATCH = 10_000  # of a GPU, which is busy with many


class Sweep(NamedTuple):
    """Runs of one flow, a member each.

    Args:
        coordinates: after each interval (K, S, M); NaN from a member's fault on.
        code: of the fault, a `FaultCode` (K,); 0 if there was none.
        step: that met it (K,); -1 if there was none.
        run_seconds, compile_seconds: wall-clock time [s].
    """

    coordinates: Float[np.ndarray, "members snapshots modes"]
    code: Int[np.ndarray, " members"]
    step: Int[np.ndarray, " members"]
    run_seconds: float
    compile_seconds: float


def sweep(
    flow: ReducedFlow,
    starts: Float[Array, "members modes"],
    values: Float[Array, " *members_and_coefficients"],
    schedule: Schedule,
    *,
    batch: int | None = None,
    progress: Callable[[int], None] | None = None,
) -> Sweep:
    """Run a flow from each start at its coefficients by `jax.vmap` of the time loop.

    Members are shared out over this process' devices. One that meets a fault stops alone. The
    first batch runs twice, once to compile.

    Args:
        flow: to run.
        starts: coordinates at the start.
        values: theta of each member; a viscosity [m^2/s], say.
        schedule: of all members.
        batch: members that a device runs at a time; 500 on a CPU, whose cache holds them, and
            10,000 on a GPU if it is not given.
        progress: is called with the number of members done since its last call.

    Raises:
        ValueError: if there is no member, there are not as many starts as coefficients, or a
            device has no memory for the batch; nothing is run then.
    """
    if schedule.intervals < 1:
        raise ValueError("schedule: at least one interval to run, got none.")
    times = EvenTimes.of(schedule, flow.reference.points.dtype)
    return swept(flow, starts, values, times, batch=batch, progress=progress)


def swept(
    flow: ReducedFlow,
    starts: Float[Array, "members modes"],
    values: Float[Array, " *members_and_coefficients"],
    times: Times,
    *,
    batch: int | None = None,
    progress: Callable[[int], None] | None = None,
) -> Sweep:
    """`sweep` at given times."""
    dtype = flow.reference.points.dtype
    starts, values = (np.asarray(a, dtype) for a in (starts, values))
    count = len(values)
    if count == 0 or starts.shape != (count, flow.system.size):
        raise ValueError(
            f"starts: {starts.shape} for {count} members and {flow.system.size} modes; give one "
            "start for each member, and at least one."
        )
    devices = jax.local_devices()
    spread = NamedSharding(Mesh(np.asarray(devices), ("members",)), PartitionSpec("members"))
    if batch is None:
        batch = _BATCH if devices[0].platform == "cpu" else _WIDE_BATCH
    batch = min(batch, -(-count // len(devices)))
    size = len(devices) * batch
    coordinates = np.empty((count, times.count, flow.system.size), dtype)
    faults = np.empty((2, count), np.int32)
    seconds, first = [], None
    for begin in range(0, count, size):
        rows = np.arange(begin, min(begin + size, count))
        filled = np.resize(rows, size)  # the last batch repeats members to be full
        arguments = (
            flow.system, flow.bound, times, jax.device_put(starts[filled], spread),
            jax.device_put(values[filled], spread),
        )  # fmt: skip
        if first is None:
            _check_room(arguments, devices[0], batch)
            before = clock.perf_counter()
            jax.block_until_ready(batch_of(*arguments))
            first = clock.perf_counter() - before
        before = clock.perf_counter()
        found, code, at = jax.block_until_ready(batch_of(*arguments))
        seconds.append(clock.perf_counter() - before)
        done = slice(len(rows))
        coordinates[rows], faults[:, rows] = found[done], (code[done], at[done])
        if progress is not None:
            progress(len(rows))
    return Sweep(coordinates, *faults, sum(seconds), max(0.0, first - seconds[0]))


def _check_room(arguments: tuple, device: Device, batch: int) -> None:
    if device.memory_stats():  # a CPU tells nothing
        check_room(batch_of.lower(*arguments).compile().compiled, device, batch)


@eqx.filter_jit
@full_precision
def batch_of(system, bound, times, starts, values):
    """Coordinates, fault code and step of members; pure."""

    def member(start, values):
        found, fault, good = times.run(PointsModel(system, values, bound), start)
        return jnp.where(good[:, None], found, jnp.nan), fault.code, fault.step

    return jax.vmap(member)(starts, values)
