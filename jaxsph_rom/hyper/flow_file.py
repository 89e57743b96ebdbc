"""A trained flow as a file that needs nothing else."""

from __future__ import annotations

import json
import os
from typing import Any

import jax.numpy as jnp
import numpy as np

from jaxsph import Box, Fluid, Space, interpolation, kernels

from ..basis import Basis
from ..reference import ReferenceSpace
from .quadratic_system import QuadraticSystem
from .recovery import Recovery
from .reduced_flow import ReducedFlow
from .trained_flow import TrainedFlow
from .whole_file import read_whole, write_whole

FORMAT = "jaxsph reduced flow"
SCHEMA_VERSION = 1
# dataset: axes, unit
_LAYOUT = {
    "points": ("points dim", "m"),
    "modes": ("points fields modes", "of the fields, per unit coordinate"),
    "centre": ("places fields", "of the fields; one place stands for all points"),
    "weights": ("fields", "of the inner product"),
    "singular_values": ("values", "of the inner product"),
    "constant": ("two modes", "coordinate/s; second row per m^2/s"),
    "linear": ("two modes modes", "1/s; second matrix per m^2/s"),
    "quadratic": ("modes modes modes", "1/s per unit coordinate"),
    "viscosities": ("runs", "m^2/s"),
    "starts": ("runs modes", "coordinate"),
    # without a recovery these have no entries
    "recovered_velocity": ("recovered dim coordinates", "m/s per unit coordinate"),
    "recovered_mean": ("recovered", "kg/m^3"),
    "recovered_modes": ("recovered density_modes", "kg/m^3 per unit coordinate"),
    "recovered_constant": ("density_modes", "coordinate"),
    "recovered_linear": ("density_modes coordinates", "coordinate per unit coordinate"),
    "recovered_quadratic": ("density_modes coordinates coordinates", "coordinate per unit squared"),
}
_BASIS = ("modes", "centre", "weights", "singular_values")
_SYSTEM = ("constant", "linear", "quadratic")
_RECOVERY = ("velocity", "mean", "modes", "constant", "linear", "quadratic")


def save_flow(path: str | os.PathLike, trained: TrainedFlow) -> None:
    """Write a trained flow to an HDF5 file, whole or not at all; a file that is there is replaced.

    Raises:
        TrajectoryFileError: if the file cannot be written.
    """
    flow = trained.flow
    space, fluid = flow.reference.space, flow.fluid
    box = space.box
    attributes = {
        "map": type(flow.reference.map).__name__,
        "kernel": type(space.kernel).__name__,
        "box_lower": box.lower,
        "box_upper": box.upper,
        "box_periodic": box.periodic,
        "smoothing_length": space.smoothing_length,
        "spacing": space.spacing,
        "reference_density": float(fluid.reference_density),
        "sound_speed": float(fluid.sound_speed),
        "reference_speed": float(fluid.reference_speed),
        "scene": trained.scene,
        "parameters": json.dumps(trained.parameters),
        "training": json.dumps(trained.training),
        "speed_times_length": trained.speed_times_length,
        "time_step": trained.time_step,
        "steps_per_snapshot": trained.steps_per_snapshot,
        "snapshots": trained.snapshots,
    }
    arrays = {
        "points": flow.reference.points,
        **{name: getattr(flow.basis, name) for name in _BASIS},
        **{name: getattr(flow.system, name) for name in _SYSTEM},
        "viscosities": trained.viscosities,
        "starts": trained.starts,
        **_recovered(flow),
    }
    write_whole(path, (FORMAT, SCHEMA_VERSION), _LAYOUT, arrays, attributes)


def _recovered(flow: ReducedFlow) -> dict[str, np.ndarray]:
    if flow.recovery is not None:
        return {f"recovered_{name}": getattr(flow.recovery, name) for name in _RECOVERY}
    length = {"dim": flow.reference.points.shape[1]}
    return {
        name: np.zeros([length.get(axis, 0) for axis in axes.split()])
        for name, (axes, _) in _LAYOUT.items()
        if name.startswith("recovered_")
    }


def load_flow(path: str | os.PathLike) -> TrainedFlow:
    """The trained flow in a file.

    Raises:
        FlowFileError: if the file is not a whole file of a reduced flow, or of a newer schema.
    """
    kind = (FORMAT, SCHEMA_VERSION)
    return read_whole(path, kind, _LAYOUT, "`jaxsph-rom train`", _assembled)


def _assembled(
    attributes: dict[str, Any], arrays: dict[str, np.ndarray], sizes: dict[str, int]
) -> TrainedFlow:
    whole = sizes["places"] in (1, sizes["points"])
    if sizes["fields"] != sizes["dim"] + 1 or sizes["two"] != 2 or not whole:
        raise ValueError("fields")
    recovery = None
    if sizes["recovered"]:
        if (sizes["recovered"], sizes["coordinates"]) != (sizes["points"], sizes["modes"]):
            raise ValueError("recovered")
        recovery = Recovery(*(jnp.asarray(arrays[f"recovered_{name}"]) for name in _RECOVERY))
    box = Box(
        *(tuple(map(float, attributes[f"box_{name}"])) for name in ("lower", "upper")),
        tuple(map(bool, attributes["box_periodic"])),
    )
    kernel = getattr(kernels, attributes["kernel"])()
    h, dx = (float(attributes[name]) for name in ("smoothing_length", "spacing"))
    rule = getattr(interpolation, attributes["map"])
    dtype = arrays["points"].dtype
    names = ("reference_density", "sound_speed", "reference_speed")
    fluid = Fluid(*(jnp.asarray(attributes[name], dtype) for name in names))
    flow = ReducedFlow(
        ReferenceSpace(jnp.asarray(arrays["points"]), Space(box, kernel, h, dx), rule),
        Basis(*(arrays[name] for name in _BASIS)),
        QuadraticSystem(*(jnp.asarray(arrays[name]) for name in _SYSTEM)),
        fluid,
        recovery,
    )
    return TrainedFlow(
        flow,
        arrays["viscosities"],
        arrays["starts"],
        *(float(attributes[name]) for name in ("speed_times_length", "time_step")),
        *(int(attributes[name]) for name in ("steps_per_snapshot", "snapshots")),
        attributes["scene"],
        *(json.loads(attributes[name]) for name in ("parameters", "training")),
    )
