"""Reading trajectories that do not fit memory, some snapshots at a time."""

from __future__ import annotations

import functools
import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ..trajectory import Trajectory
from .trajectory_file import FIELDS, TrajectoryFileError, opened, patient, read_more


def snapshot_blocks(path: str | os.PathLike, size: int, every: int = 1) -> Iterator[Trajectory]:
    """The trajectory in a file in consecutive blocks of at most `size` snapshots.

    Put together, the blocks are what `read_trajectory` reads; each has the metadata of all. What a
    run adds after the call is left out. The file is open only while a block is read.

    Args:
        path: of the file.
        size: snapshots in a block; the last one may have fewer.
        every: take every N-th snapshot, from the first on.

    Raises:
        ValueError: if one of these numbers is below 1.
        TrajectoryFileError: if the file is not a whole trajectory file with a snapshot in it, or,
            between blocks, if it was replaced by another run.
    """
    if size < 1:
        raise ValueError(f"size: {size} snapshots a block; give at least 1.")
    if every < 1:
        raise ValueError(f"every: every {every}-th snapshot; give at least 1.")
    path = Path(path)
    count, parameters, metadata = _overview(path)

    def read(path: Path, start: int) -> Trajectory:
        stop = min(start + size * every, count)
        block = slice(start, stop, every)
        with opened(path) as (file, there):
            if there < stop or file.attrs["parameters"] != parameters:
                raise TrajectoryFileError(
                    f"{path}: was replaced by another run while it was read; read it anew."
                )
            fields = {name: file[name][block] for name in ("time", *FIELDS)}
            coordinates = file["coordinates"][block] if "coordinates" in file else None
            more = read_more(file, block)
            return Trajectory(**fields, coordinates=coordinates, metadata=metadata, **more)

    starts = range(0, count, size * every)
    return (patient(functools.partial(read, start=start))(path) for start in starts)


@patient
def _overview(path: Path) -> tuple[int, str, dict[str, Any]]:
    """Number of snapshots, record of the scene's parameters, and metadata of the trajectory."""
    with opened(path) as (file, count):
        if count == 0:
            raise TrajectoryFileError(f"{path}: holds no snapshot yet; run its scene anew.")
        metadata = json.loads(file.attrs["metadata"])
        if not file.attrs["complete"]:
            metadata.setdefault("time_step", float(file.attrs["time_step"]))
            metadata["steps"] = int(file["step"][count - 1])
        return count, file.attrs["parameters"], metadata
