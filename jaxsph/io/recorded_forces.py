"""Forces and torques on the walls in a trajectory file, and what is told of them."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from jaxtyping import Float

from ..wall_forces import WallForces
from .growing_file import add_dataset
from .trajectory_file import opened, patient

_LAST = 0.2  # of a run: the mean of its coefficients is over that
_MEANS = ("drag_coefficient", "lift_coefficient")
_REFERENCES = ("reference_speed", "reference_length", "reference_density")


@dataclass(frozen=True)
class ForceHistory:
    """The force on a part of the walls at each of S snapshots.

    Args:
        time: (S,) [s].
        force: (S, n) [N], of a metre's depth in two dimensions: means over the time since the
            snapshot before where `averaged`, else those of the instants.
        averaged: which of the two.
        scale: 2 / (rho0 U^2 L^(n - 1)) [1/N], by which it becomes coefficients; NaN if there is no
            reference.
    """

    time: Float[np.ndarray, " times"]
    force: Float[np.ndarray, "times dim"]
    averaged: bool
    scale: float


@patient
def read_forces(path: str | os.PathLike) -> dict[str, ForceHistory]:
    """The forces on the walls in a trajectory file, `walls` and each named part; it may still be
    written.

    Raises:
        TrajectoryFileError: if the file is not a whole trajectory file.
    """
    found = {}
    with opened(Path(path)) as (file, count):
        time = file["time"][:count]
        for name in parts(file):
            kind = kept_kind(file, "forces", name)
            force, averaged = file[f"{kind}/{name}"][:count], kind != "forces"
            scale = coefficient_scale(file[f"forces/{name}"])
            found[name] = ForceHistory(time, force, averaged, scale)
    return found


def begin_forces(
    file: h5py.File, forces: WallForces, dim: int, dtype: np.dtype, prefix: str = ""
) -> None:
    """Empty datasets `forces/NAME` (S, n) and `torques/NAME` for each part of the walls, or those
    of the means, `mean_forces/NAME` and `mean_torques/NAME`."""
    names = zip(forces.names, forces.reference_speeds, forces.reference_lengths, strict=True)
    for name, speed, length in names:
        made = add_dataset(file, f"{prefix}forces/{name}", (dim,), dtype)
        for key, value in zip(_REFERENCES, (speed, length, forces.density), strict=True):
            made.attrs[key] = value
        for key in () if prefix else _MEANS:  # what a file may have must be there before it grows
            made.attrs[key] = np.nan
        add_dataset(file, f"{prefix}torques/{name}", () if dim == 2 else (dim,), dtype)
    link_time(file)


def link_time(file: h5py.File) -> None:
    """`forces/time` is `time`, by another name."""
    if "forces" in file:
        if "time" in file["forces"]:
            del file["forces/time"]
        file["forces/time"] = file["time"]


def parts(file: h5py.File) -> list[str]:
    """Names of the parts whose forces a file holds."""
    return [name for name in file.get("forces", ()) if name != "time"]


def sum_up(file: h5py.File, count: int) -> None:
    """Drag and lift coefficients as attributes of `forces/NAME`: 2 F / (rho0 U^2 L^(n - 1)) of the
    mean force along the first and the second axis over the run's last fifth."""
    for name in parts(file):
        dataset = file[f"forces/{name}"]
        mean = coefficient_scale(dataset) * _late(file, "forces", name, count)
        for key, value in zip(_MEANS, mean[:2], strict=True):
            dataset.attrs.modify(key, value)


def coefficient_scale(dataset: h5py.Dataset) -> float:
    """2 / (rho0 U^2 L^(n - 1)) [1/N] of the forces in a dataset; NaN where these have no reference.
    """
    return scale_of(*(float(dataset.attrs[key]) for key in _REFERENCES), dataset.shape[-1])


def scale_of(speed: float, length: float, density: float, dim: int) -> float:
    """The same of U [m/s], L [m] and rho0 [kg/m^3]."""
    return 2.0 / (density * speed**2 * length ** (dim - 1))


def kept_kind(file: h5py.File, kind: str, name: str) -> str:
    """`mean_forces` or `mean_torques` of a part where a file has them, else those of instants."""
    return f"mean_{kind}" if f"mean_{kind}/{name}" in file else kind


def _late(file: h5py.File, kind: str, name: str, count: int) -> np.ndarray:
    """The mean over the last fifth of a run: of the means between snapshots if there are any, each
    with the time it has in that fifth, else of the instants that lie in it."""
    time, kind = file["time"][:count].astype(np.float64), kept_kind(file, kind, name)
    since = time[-1] - _LAST * (time[-1] - time[0])
    if kind.startswith("mean_"):  # a mean is one over the time before its snapshot
        weights = np.diff(np.maximum(time, since), prepend=since)
    else:
        weights = (time >= since - 1e-9 * (time[-1] - time[0])).astype(np.float64)
    if not weights.any():  # a single snapshot
        weights[-1] = 1.0
    late = weights > 0.0
    return np.average(file[f"{kind}/{name}"][:count][late], axis=0, weights=weights[late])


def told(file: h5py.File, count: int) -> dict[str, dict[str, Any]]:
    """Force and torque on each part, at last and in the mean over the last fifth of what is there,
    and the coefficients of these means with what they refer to."""
    found = {}
    for name in parts(file):
        attributes = file[f"forces/{name}"].attrs
        told = {"last_force": None, "last_torque": None}
        if count:
            mean = _late(file, "forces", name, count)
            scale = coefficient_scale(file[f"forces/{name}"])
            told = {
                "last_force": file[f"forces/{name}"][count - 1].tolist(),
                "last_torque": file[f"torques/{name}"][count - 1].tolist(),
                "mean_force": mean.tolist(),
                "mean_torque": _late(file, "torques", name, count).tolist(),
                **dict(zip(_MEANS, (scale * mean[:2]).tolist(), strict=True)),
            }
        found[name] = told | {key: float(attributes[key]) for key in _REFERENCES}
    return found
