"""The whole run of a member, as one program."""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float

from ..forces_over_time import ForcesOverTime
from ..full_model import FullModel
from ..integrate import FaultCode, integrate
from ..particles import ParticleState
from ..schedule import Schedule
from ..trajectory import Snapshot
from ..wall_forces import WallForces, loads, named
from ..wall_surface import Loads

_KINDS = ("forces", "torques")


def run_member(
    model: FullModel, state: ParticleState, forces: WallForces | None, schedule: Schedule
) -> tuple[Snapshot, tuple[Array, Array, Array, Array]]:
    """Snapshots (S, ...) with what `run_scene` has in them, and (code, step, particle, number of
    good snapshots)."""
    each, intervals = schedule.steps_per_snapshot, schedule.intervals
    step = jnp.asarray(schedule.time_step, state.density.dtype)
    averaged = named(forces)
    stepped = model if averaged is None else ForcesOverTime(model, averaged)
    start = state if averaged is None else stepped.start(state)
    _, fault, later, good = integrate(
        stepped, start, jnp.zeros((), jnp.int32), step, each, intervals
    )
    seen = jax.tree.map(lambda a, b: jnp.concatenate([a[None], b]), stepped.observe(start), later)
    snapshots, impulses = (seen, None) if averaged is None else seen
    good = jnp.concatenate([jnp.ones(1, bool), good])
    code = fault.code
    if forces is not None:
        at = _instants(forces, model, snapshots, each * step)
        snapshots = _with(snapshots, "", forces.names, at)
        if averaged is not None:
            since = jax.tree.map(lambda sums: jnp.diff(sums, axis=0) / (each * step), impulses)
            means = jax.tree.map(lambda a, b: jnp.concatenate([a[:1], b]), at, since)
            snapshots = _with(snapshots, "mean_", averaged.names, means)
        # the list of a snapshot's own has overflowed: a member with more room has it
        missing = jnp.any(good & ~jnp.all(jnp.isfinite(at.force), axis=(1, 2)))
        code = jnp.where(missing, int(FaultCode.NEIGHBOR_OVERFLOW), code)
    sound = jnp.all(jnp.isfinite(state.density + jnp.sum(state.velocity, axis=1)))
    count = jnp.where(sound, jnp.sum(good, dtype=jnp.int32), 0)
    return snapshots, (code, fault.step, fault.particle, count)


def _instants(
    forces: WallForces, model: FullModel, snapshots: Snapshot, interval: Float[Array, ""]
) -> Loads:
    """Forces (S, K, n) and torques at each of S snapshots."""
    fields = (snapshots.position, snapshots.velocity, snapshots.density, snapshots.bodies)
    times = interval * jnp.arange(len(snapshots.density), dtype=interval.dtype)
    return lax.map(lambda at: loads(forces, model, *at), (times, ParticleState(*fields)))


def _with(snapshots: Snapshot, prefix: str, names: tuple[str, ...], found: Loads) -> Snapshot:
    """Snapshots with loads (S, K, ...) by the names of the walls' parts."""
    by_name = ({name: each[:, k] for k, name in enumerate(names)} for each in found)
    kinds = (prefix + kind for kind in _KINDS)
    return dataclasses.replace(snapshots, **dict(zip(kinds, by_name, strict=True)))
