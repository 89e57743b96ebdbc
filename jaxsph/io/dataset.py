"""Trajectories as labelled arrays."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..record import plain
from ..trajectory import Trajectory
from .trajectory_file import FIELDS, UNITS

_DIMENSIONS = ("time", "particle", "direction")


def dataset(trajectory: Trajectory) -> Any:
    """The fields of a trajectory as an `xarray.Dataset`; see `Trajectory.to_xarray`.

    Raises:
        ImportError: if xarray is not installed.
    """
    try:
        import xarray
    except ImportError:
        raise ImportError("xarray is not there; install it, or the extra jaxsph[xarray].") from None
    fields = {name: np.asarray(getattr(trajectory, name)) for name in FIELDS}
    arrays = {
        name: (_DIMENSIONS[: value.ndim], value, {"units": UNITS[name]})
        for name, value in fields.items()
    }
    if trajectory.coordinates is not None:
        values = np.asarray(trajectory.coordinates)
        arrays["coordinates"] = (("time", "mode"), values, {"units": UNITS["coordinates"]})
    if trajectory.active is not None:
        arrays["active"] = (("time", "particle"), np.asarray(trajectory.active))
    axes = {
        "time": ("time", np.asarray(trajectory.time), {"units": UNITS["time"]}),
        "direction": list("xyz"[: fields["position"].shape[-1]]),
    }
    return xarray.Dataset(arrays, axes, plain(trajectory.metadata))
