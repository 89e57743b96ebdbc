"""Snapshots as point clouds of PyVista."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..trajectory import Snapshot
from .vtkhdf import EXPORTED


def point_cloud(time: float, snapshot: Snapshot) -> Any:
    """A snapshot as a `pyvista.PolyData`; see `Trajectory.to_pyvista`.

    Raises:
        ImportError: if PyVista is not installed.
    """
    try:
        import pyvista
    except ImportError:
        raise ImportError(
            "pyvista is not there; install it, or the extra jaxsph[pyvista]."
        ) from None
    snapshot = snapshot.in_flow()
    missing = 3 - snapshot.position.shape[-1]

    def in_space(vectors):
        return np.pad(np.asarray(vectors), ((0, 0), (0, missing)))

    cloud = pyvista.PolyData(in_space(snapshot.position))
    for name in EXPORTED:
        values = np.asarray(getattr(snapshot, name))
        cloud.point_data[name] = in_space(values) if values.ndim == 2 else values
    cloud.field_data["time"] = [time]
    return cloud
