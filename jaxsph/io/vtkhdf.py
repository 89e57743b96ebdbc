"""Trajectories as VTKHDF files, which ParaView (5.12 and later) opens with all their times.

One HDF5 file by the VTKHDF specification 2.0, type PolyData: a vertex for each particle, the points
of all steps one after another, and `Steps` that say where each begins. Vertices are the same at all
times and are stored once; where particles come in and go out each step says how many of them it
has. Two-dimensional vectors get a third component of zero.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path

import h5py
import numpy as np

from ..trajectory import Trajectory
from .snapshot_blocks import snapshot_blocks
from .trajectory_file import UNITS
from .whole_file import whole_file

EXPORTED = ("velocity", "density", "pressure")
_CELLS = ("Vertices", "Lines", "Polygons", "Strips")  # in the order of `Steps/CellOffsets`
_COMPRESSION = {"compression": "gzip", "compression_opts": 1, "shuffle": True}


def write_vtkhdf(
    source: str | os.PathLike,
    path: str | os.PathLike,
    fields: Sequence[str] = EXPORTED,
    every: int = 1,
    progress: Callable[[int], None] | None = None,
) -> Path:
    """Write the trajectory in a file as VTKHDF, one snapshot at a time, and return its path.

    Units are SI: m, s, m/s, kg/m^3, Pa; each dataset has its own as the attribute `unit`.

    Args:
        source: the trajectory file; it may still be written.
        path: of the new file, which ends with `.vtkhdf` for ParaView; one that is there is
            replaced once the new one is whole.
        fields: of `velocity`, `density`, `pressure`, those to write beside the positions.
        every: write every N-th snapshot, from the first on.
        progress: is called with the number of snapshots written since its last call.

    Raises:
        ValueError: if a field is not known, or `every` is below 1.
        TrajectoryFileError: if the source is not a whole trajectory file with a snapshot in it, or
            the new file cannot be written.
    """
    path = Path(path)
    unknown = [name for name in fields if name not in EXPORTED]
    if unknown:
        raise ValueError(
            f"fields: {', '.join(unknown)} is not known; choose of {', '.join(EXPORTED)}."
        )
    blocks = snapshot_blocks(source, 1, every)
    if path.exists() and path.samefile(source):
        raise ValueError(f"{path}: is the trajectory itself; choose another file.")
    with whole_file(path) as file:
        root = file.create_group("VTKHDF")
        for number, block in enumerate(blocks):
            if number == 0:
                _begin(root, block, fields)
            _append(root, block, fields)
            if progress is not None:
                progress(1)
    return path


def _begin(root: h5py.Group, first: Trajectory, fields: Sequence[str]) -> None:
    """Attributes, vertices, and datasets without a row."""
    particles = first.particles
    root.attrs["Version"] = np.array([2, 0], np.int64)
    root.attrs["Type"] = np.bytes_("PolyData")
    root.attrs["units"] = "SI"
    _rows(root, "NumberOfPoints", (), np.int64)
    for name in _CELLS:
        count = particles if name == "Vertices" else 0
        cells = root.create_group(name)
        _rows(cells, "NumberOfCells", (), np.int64)
        _rows(cells, "NumberOfConnectivityIds", (), np.int64)
        cells["Connectivity"] = np.arange(count, dtype=np.int64)
        cells["Offsets"] = np.arange(count + 1, dtype=np.int64)
    _rows(root, "Points", (3,), first.position.dtype, "position", particles)
    data = root.create_group("PointData")
    steps = root.create_group("Steps")
    starts = steps.create_group("PointDataOffsets")
    for name in fields:
        value = getattr(first, name)
        shape = (3,) if value.ndim == 3 else ()
        _rows(data, name, shape, value.dtype, name, particles)
        _rows(starts, name, (), np.int64)
    steps.attrs["NSteps"] = 0
    _rows(steps, "Values", (), np.float64, "time")
    for name in ("PartOffsets", "PointOffsets", "NumberOfParts"):
        _rows(steps, name, (), np.int64)
    for name in ("CellOffsets", "ConnectivityIdOffsets"):
        _rows(steps, name, (len(_CELLS),), np.int64)


def _append(root: h5py.Group, block: Trajectory, fields: Sequence[str]) -> None:
    """The rows of one snapshot."""
    snapshot, steps = block.snapshot(0).in_flow(), root["Steps"]
    start, number, count = len(root["Points"]), steps.attrs["NSteps"], len(snapshot.position)
    if number == 0 or block.active is not None:  # else all steps share the one part
        _extend(root["NumberOfPoints"], [count])
        for name in _CELLS:
            for counted in ("NumberOfCells", "NumberOfConnectivityIds"):
                _extend(root[name][counted], [count if name == "Vertices" else 0])
    _extend(root["Points"], _padded(snapshot.position))
    for name in fields:
        _extend(root["PointData"][name], _padded(getattr(snapshot, name)))
        _extend(steps["PointDataOffsets"][name], [start])
    _extend(steps["Values"], block.time)
    _extend(steps["PointOffsets"], [start])
    _extend(steps["PartOffsets"], [len(root["NumberOfPoints"]) - 1])
    _extend(steps["NumberOfParts"], [1])
    for name in ("CellOffsets", "ConnectivityIdOffsets"):
        _extend(steps[name], np.zeros((1, len(_CELLS)), np.int64))
    steps.attrs["NSteps"] = number + 1


def _rows(group, name, shape, dtype, quantity=None, chunk=64) -> None:
    """An empty dataset that grows by rows; one of particles has a chunk a snapshot."""
    options = {} if quantity in (None, "time") else _COMPRESSION
    dataset = group.create_dataset(
        name, (0, *shape), dtype, maxshape=(None, *shape), chunks=(chunk, *shape), **options
    )
    if quantity is not None:
        dataset.attrs["unit"] = UNITS[quantity]


def _extend(dataset: h5py.Dataset, rows) -> None:
    start = len(dataset)
    dataset.resize(start + len(rows), 0)
    dataset[start:] = rows


def _padded(value: np.ndarray) -> np.ndarray:
    """Vectors (N, 2) as (N, 3); all else as it is."""
    if value.ndim == 2 and value.shape[1] == 2:
        return np.pad(value, ((0, 0), (0, 1)))
    return value
