"""The whole run of a member, as one program."""

from __future__ import annotations

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Bool, Float

from ..forces_over_time import ForcesOverTime
from ..full_model import FullModel
from ..integrate import Fault, FaultCode, integrate
from ..integrate.one_or_many import moved_if
from ..particles import ParticleState
from ..schedule import Schedule
from ..trajectory import Snapshot
from ..wall_forces import WallForces, guarded, named
from ..wall_surface import Loads

_KINDS = ("forces", "torques")


def run_member(
    model: FullModel, state: ParticleState, forces: WallForces | None, schedule: Schedule
) -> tuple[Snapshot, tuple[Array, Array, Array, Array]]:
    """Snapshots (S, ...) with what `run_scene` has in them, and (code, step, particle, number of
    good snapshots)."""
    each, averaged = schedule.steps_per_snapshot, named(forces)
    step = jnp.asarray(schedule.time_step, state.density.dtype)
    stepped = model if averaged is None else ForcesOverTime(model, averaged)

    def interval(carry, first_step):
        def run(carry):
            begun, _, _ = carry  # with no impulse yet, as in a run of its own
            begun = begun if averaged is None else stepped.start(begun)
            ended, fault, *_ = integrate(stepped, begun, first_step, step, each, 1)
            if averaged is None:
                return ended, fault, None
            return ended.particles, fault, ended.impulse

        carry = moved_if(carry[1].code == int(FaultCode.NONE), run, carry)
        state, fault, impulse = carry
        return carry, (model.observe(state), fault.code == int(FaultCode.NONE), impulse)

    impulse = None if averaged is None else stepped.start(state).impulse
    starts = each * jnp.arange(schedule.intervals, dtype=jnp.int32)
    (_, fault, _), (later, good, impulses) = lax.scan(
        interval, (state, Fault.none(), impulse), starts
    )
    snapshots = jax.tree.map(
        lambda a, b: jnp.concatenate([a[None], b]), model.observe(state), later
    )
    good = jnp.concatenate([jnp.ones(1, bool), good])
    sound = jnp.all(jnp.isfinite(state.density + jnp.sum(state.velocity, axis=1)))
    count = jnp.where(sound, jnp.sum(good, dtype=jnp.int32), 0)
    status = (fault.code, fault.step, fault.particle, count)
    if forces is None:
        return snapshots, status
    at, overflow = _instants(forces, model, snapshots, each * step)
    snapshots, missing = _with(snapshots, "", forces.names, at), overflow | _not_finite(at)
    if averaged is not None:
        since = jax.tree.map(lambda sums: sums / (each * step), impulses)
        means = jax.tree.map(lambda a, b: jnp.concatenate([a[:1], b]), at, since)
        snapshots = _with(snapshots, "mean_", averaged.names, means)
        missing = missing | _not_finite(means)
    return snapshots, _judged(status, missing & good & sound, overflow, each)


def _instants(
    forces: WallForces, model: FullModel, snapshots: Snapshot, interval: Float[Array, ""]
) -> tuple[Loads, Bool[Array, " times"]]:
    """Forces (S, K, n) and torques at each of S snapshots, and whether their list overflowed."""
    fields = (snapshots.position, snapshots.velocity, snapshots.density, snapshots.bodies)
    times = interval * jnp.arange(len(snapshots.density), dtype=interval.dtype)
    return lax.map(lambda at: guarded(forces, model, *at), (times, ParticleState(*fields)))


def _not_finite(found: Loads) -> Bool[Array, " times"]:
    """Which snapshots have a force or a torque that is no number."""
    bad = [~jnp.isfinite(each).reshape(len(each), -1).all(axis=1) for each in found]
    return bad[0] | bad[1]


def _judged(status: tuple, bad: Bool[Array, " times"], overflow, each: int) -> tuple[Any, ...]:
    """The status of a member whose forces are bad at some snapshots, which come before its fault:
    a list without room for them, which one with more has, or forces that are no numbers."""
    first, any_bad = jnp.argmax(bad).astype(jnp.int32), jnp.any(bad)
    code = jnp.where(overflow[first], FaultCode.NEIGHBOR_OVERFLOW, FaultCode.NOT_FINITE)
    found = (code.astype(status[0].dtype), each * first, jnp.full((), -1, jnp.int32), first)
    return tuple(jnp.where(any_bad, a, b) for a, b in zip(found, status, strict=True))


def _with(snapshots: Snapshot, prefix: str, names: tuple[str, ...], found: Loads) -> Snapshot:
    """Snapshots with loads (S, K, ...) by the names of the walls' parts."""
    by_name = ({name: each[:, k] for k, name in enumerate(names)} for each in found)
    kinds = (prefix + kind for kind in _KINDS)
    return dataclasses.replace(snapshots, **dict(zip(kinds, by_name, strict=True)))
