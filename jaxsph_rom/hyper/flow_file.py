"""A reduced flow as a file that needs nothing else."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import h5py
import jax.numpy as jnp
import numpy as np

from jaxsph import Box, Fluid, Space, interpolation, kernels
from jaxsph.environment import versions
from jaxsph.io import check_target

from ..basis import Basis
from ..reference import ReferenceSpace
from .quadratic_system import QuadraticSystem
from .reduced_flow import ReducedFlow

FORMAT = "jaxsph reduced flow"
SCHEMA_VERSION = 1
_SIGNATURE = b"\x89HDF\r\n\x1a\n"
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
}


class FlowFileError(ValueError):
    """A reduced flow's file that cannot be read; one line says why and what to do."""


def save_flow(path: str | os.PathLike, flow: ReducedFlow) -> None:
    """Write a reduced flow to an HDF5 file, whole or not at all; a file that is there is replaced.

    Raises:
        TrajectoryFileError: if the file cannot be written.
    """
    path = Path(path)
    check_target(path)
    space, fluid = flow.reference.space, flow.fluid
    box = space.box
    attributes = {
        "format": FORMAT,
        "schema_version": SCHEMA_VERSION,
        "units": "SI",
        "versions": json.dumps(versions()),
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
    }
    arrays = {
        "points": flow.reference.points,
        **{name: getattr(flow.basis, name) for name in _LAYOUT if hasattr(flow.basis, name)},
        **{name: getattr(flow.system, name) for name in ("constant", "linear", "quadratic")},
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        with h5py.File(unfinished, "w") as file:
            for name, (axes, unit) in _LAYOUT.items():
                dataset = file.create_dataset(name, data=np.asarray(arrays[name]))
                dataset.attrs["axes"], dataset.attrs["unit"] = axes, unit
            for name, value in attributes.items():
                file.attrs[name] = value
        os.replace(unfinished, path)
    finally:
        unfinished.unlink(missing_ok=True)


def load_flow(path: str | os.PathLike) -> ReducedFlow:
    """The reduced flow in a file.

    Raises:
        FlowFileError: if the file is not a whole file of a reduced flow, or of a newer schema.
    """
    path = Path(path)
    try:
        with open(path, "rb") as file:
            signature = file.read(len(_SIGNATURE))
    except OSError as error:
        raise FlowFileError(f"{path}: cannot be read ({error.strerror}); check its name.") from None
    if signature != _SIGNATURE:
        raise FlowFileError(f"{path}: is not an HDF5 file; give one that `save_flow` wrote.")
    try:
        with h5py.File(path, "r") as file:
            attributes = dict(file.attrs)
            _check(path, attributes)
            arrays = {name: file[name][...] for name in _LAYOUT}
        sizes = _sizes(arrays)
        whole = sizes["places"] in (1, sizes["points"])
        if sizes["fields"] != sizes["dim"] + 1 or sizes["two"] != 2 or not whole:
            raise ValueError("fields")
        return _assembled(attributes, arrays)
    except FlowFileError:
        raise
    except (OSError, KeyError, ValueError, TypeError, AttributeError, RuntimeError):
        raise FlowFileError(
            f"{path}: is truncated or damaged and cannot be read; restore a copy or train anew."
        ) from None


def _check(path: Path, attributes: dict[str, Any]) -> None:
    if attributes.get("format") != FORMAT:
        raise FlowFileError(
            f"{path}: is HDF5 but holds no reduced flow; give a file that `save_flow` wrote."
        )
    version = int(attributes["schema_version"])
    if version > SCHEMA_VERSION:
        raise FlowFileError(
            f"{path}: has schema version {version}, this jaxsph_rom reads {SCHEMA_VERSION}; use "
            "the version that wrote it, or a newer one."
        )


def _sizes(arrays: dict[str, np.ndarray]) -> dict[str, int]:
    """The length of every axis; a ValueError if two datasets disagree."""
    sizes: dict[str, int] = {}
    for name, (axes, _) in _LAYOUT.items():
        for axis, length in zip(axes.split(), arrays[name].shape, strict=True):
            if sizes.setdefault(axis, length) != length:
                raise ValueError(axis)
    return sizes


def _assembled(attributes: dict[str, Any], arrays: dict[str, np.ndarray]) -> ReducedFlow:
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
    return ReducedFlow(
        ReferenceSpace(jnp.asarray(arrays["points"]), Space(box, kernel, h, dx), rule),
        Basis(*(arrays[name] for name in ("modes", "centre", "weights", "singular_values"))),
        QuadraticSystem(*(jnp.asarray(arrays[n]) for n in ("constant", "linear", "quadratic"))),
        fluid,
    )
