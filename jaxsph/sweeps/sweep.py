"""Many full models at once, on all devices of all processes."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np
from jax.experimental import multihost_utils
from jax.sharding import Mesh, NamedSharding, PartitionSpec

from ..clumping import Clumping
from ..compiled import full_precision
from ..compiler_options import platform_options
from ..devices import Devices
from ..integrate import FaultCode
from ..io import Lock
from ..scenes import Scene
from ..trajectory import Snapshot
from . import sweep_file
from .member_run import run_member
from .members import Members, stacked
from .room import check_room
from .sweep_file import NOT_RUN, Status, read_status

_ENLARGEMENTS = 8  # of the neighbour list, together a factor of four
_AXIS = "members"


def sweep(
    scenes: Sequence[Scene],
    path: str | os.PathLike,
    *,
    batch: int = 1,
    progress: Callable[[int], None] | None = None,
) -> Status:
    """Run the full models of many scenes and write all to one file, each member with its status.

    Members are shared out over all devices, by JAX's sharding of a leading axis; with
    `jax.distributed` over those of all processes, which call this alike. What is written after each
    round stays: the same call goes on where a killed one ended. A member that meets a fault ends
    alone, with the snapshots that it had; one whose neighbour list overflows is run anew with more
    room. One whose particles have clumped at its end is named in a warning. Where there are walls,
    forces on them are kept as by `run_scene`, and so are free bodies.

    Args:
        scenes: that differ in what their arrays hold: coefficients and starts.
        path: of the HDF5 file.
        batch: members that a device runs side by side, by `jax.vmap`. On a CPU one is best: it uses
            all cores already, and rebuilds its neighbour list when it must, where a batch builds
            the lists of all when any of them must. A GPU takes all members of a batch in each
            kernel, and wants as many as fit its memory.
        progress: is called with the number of members done since its last call.

    Returns:
        how each member went; `read_member(path, k)` has its snapshots with the forces in them,
        `read_member_forces(path, k)` what their coefficients refer to.

    Raises:
        ValueError: if the scenes differ in more, the batch is below one, or a device has not the
            memory for it; nothing is run then.
        SweepFileError: if the file holds another sweep or cannot be written.
    """
    if batch < 1:
        raise ValueError(f"batch: at least 1, got {batch}.")
    members = stacked(scenes)
    every = Devices(jax.devices())
    with every.by_first(lambda: Lock(Path(path))) or nullcontext():
        every.by_first(lambda: sweep_file.create(path, scenes))
        _fill(path, members, scenes[0], len(scenes), batch, every, progress)
    every.meet()  # the file is whole for all
    return read_status(path)


def _fill(path, members: Members, first: Scene, count: int, batch: int, every, progress) -> None:
    """Run the members that are not in the file yet."""
    code = every.by_first(lambda: read_status(path).code)
    code = multihost_utils.broadcast_one_to_all(np.empty(count, np.int32) if code is None else code)
    left = np.flatnonzero(code == NOT_RUN)
    if progress is not None and len(left) < count:
        progress(count - len(left))
    if not len(left):
        return
    mesh = Mesh(np.asarray(every.every), (_AXIS,))
    for attempt in range(1 + _ENLARGEMENTS):
        run = _compiled(members, first, mesh, batch)
        clumped = []
        for numbers in np.array_split(left, range(run.size, len(left), run.size)):
            found = run(members, numbers)
            for place, number in enumerate(numbers):
                snapshots, status = jax.tree.map(lambda a, place=place: a[place], found)
                if status[0] == FaultCode.NEIGHBOR_OVERFLOW and attempt < _ENLARGEMENTS:
                    clumped.append(number)
                    continue
                every.by_first(partial(_keep, path, first, number, snapshots, status))
                if progress is not None:
                    progress(1)
        if not clumped:
            break
        left, members = np.asarray(clumped), members.enlarged()


def _keep(path, first: Scene, number: int, snapshots: Snapshot, status) -> None:
    sweep_file.store(path, number, snapshots, status)
    _warn_of_clumps(first, number, snapshots, int(status[3]))


def _warn_of_clumps(scene: Scene, number: int, snapshots: Snapshot, good: int) -> None:
    """By the last good snapshot, since it is pairs that stay together that do harm."""
    if not good:
        return
    last = jax.tree.map(lambda a: np.asarray(a[good - 1]), snapshots)
    why = Clumping(scene.space)(scene.schedule.interval * (good - 1), last)
    if why is not None:
        warnings.warn(f"member {number}: {why}.", stacklevel=6)


class _Run(NamedTuple):
    """A compiled round: `size` members, shared out over the devices."""

    program: Callable
    sharding: NamedSharding
    size: int

    def __call__(self, members: Members, numbers: Sequence[int]) -> tuple[Snapshot, Any]:
        """Snapshots (size, S, ...) and (code, step, particle, good snapshots), on every host."""
        filled = np.resize(numbers, self.size)  # a last round repeats members to be full

        def spread(a):
            return jax.make_array_from_callback(a.shape, self.sharding, lambda at: a[at])

        found = self.program(jax.tree.map(spread, members.select(filled)))
        return multihost_utils.process_allgather(found, tiled=True)


def _compiled(members: Members, scene: Scene, mesh: Mesh, batch: int) -> _Run:
    schedule = scene.schedule

    def member(arrays):
        return run_member(*members.one(arrays), schedule)

    @full_precision
    def share(arrays):  # what one device does
        if batch > 1:
            return jax.vmap(member)(arrays)
        alone = member(jax.tree.map(lambda a: a[0], arrays))
        return jax.tree.map(lambda a: a[None], alone)

    spec, size = PartitionSpec(_AXIS), mesh.size * batch
    sharding = NamedSharding(mesh, spec)
    program = jax.jit(
        jax.shard_map(share, mesh=mesh, in_specs=spec, out_specs=spec, check_vma=False),
        compiler_options=platform_options(),
    )
    shapes = jax.tree.map(
        lambda a: jax.ShapeDtypeStruct((size, *a.shape[1:]), a.dtype, sharding=sharding),
        members.arrays,
    )
    program = program.lower(shapes).compile()
    check_room(program, mesh.local_devices[0], batch)
    return _Run(program, sharding, size)
