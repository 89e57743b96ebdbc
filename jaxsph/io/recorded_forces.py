"""Forces and torques on the walls in a trajectory file, and what is told of them."""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np

from ..wall_forces import WallForces
from .growing_file import add_dataset

_LAST = 0.2  # of a run: the mean of its coefficients is over that
_MEANS = ("drag_coefficient", "lift_coefficient")
_REFERENCES = ("reference_speed", "reference_length", "reference_density")


def begin_forces(file: h5py.File, forces: WallForces, dim: int, dtype: np.dtype) -> None:
    """Empty datasets `forces/NAME` (S, n) and `torques/NAME` for each part of the walls."""
    names = zip(forces.names, forces.reference_speeds, forces.reference_lengths, strict=True)
    for name, speed, length in names:
        made = add_dataset(file, f"forces/{name}", (dim,), dtype)
        for key, value in zip(_REFERENCES, (speed, length, forces.density), strict=True):
            made.attrs[key] = value
        for key in _MEANS:  # what a file may have must be there before it grows
            made.attrs[key] = np.nan
        add_dataset(file, f"torques/{name}", () if dim == 2 else (dim,), dtype)
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
    """Drag and lift coefficients as attributes: 2 F / (rho0 U^2 L^(n - 1)) of the mean force along
    the first and the second axis over the run's last fifth."""
    time = file["time"][:count]
    for name in parts(file):
        dataset = file[f"forces/{name}"]
        speed, length, density = (dataset.attrs[key] for key in _REFERENCES)
        late = time >= time[-1] - _LAST * (time[-1] - time[0])
        mean = dataset[:count][late].mean(axis=0, dtype=np.float64)
        scale = 2.0 / (density * speed**2 * length ** (len(mean) - 1))
        for key, value in zip(_MEANS, scale * mean[:2], strict=True):
            dataset.attrs.modify(key, value)


def told(file: h5py.File, count: int) -> dict[str, dict[str, Any]]:
    """The last force on each part, and the coefficients with what they refer to."""
    found = {}
    for name in parts(file):
        dataset = file[f"forces/{name}"]
        means = {key: float(dataset.attrs[key]) for key in _MEANS}
        found[name] = {
            "last_force": dataset[count - 1].tolist() if count else None,
            **(means if file.attrs["complete"] else {}),
            **{key: float(dataset.attrs[key]) for key in _REFERENCES},
        }
    return found
