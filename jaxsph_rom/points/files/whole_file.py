"""HDF5 files of named arrays and attributes, written whole and read whole or not at all."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from jaxsph.environment import versions
from jaxsph.io import whole_file

_SIGNATURE = b"\x89HDF\r\n\x1a\n"

# of every dataset: its axes, and its unit
Layout = Mapping[str, tuple[str, str]]


class FlowFileError(ValueError):
    """A file of a reduced flow that cannot be read; one line says why and what to do."""


def write_whole(
    path: str | os.PathLike,
    kind: tuple[str, int],
    layout: Layout,
    arrays: Mapping[str, Any],
    attributes: Mapping[str, Any],
) -> None:
    """Write a file in one go; one that is there is replaced.

    Args:
        path: of the file.
        kind: format and schema version.
        layout: of the datasets.
        arrays: a value for each dataset.
        attributes: of the file, beside its kind, units and versions.

    Raises:
        TrajectoryFileError: if the file cannot be written.
    """
    own = {"format": kind[0], "schema_version": kind[1], "units": "SI"}
    own["versions"] = json.dumps(versions())
    with whole_file(path) as file:
        for name, (axes, unit) in layout.items():
            dataset = file.create_dataset(name, data=np.asarray(arrays[name]))
            dataset.attrs["axes"], dataset.attrs["unit"] = axes, unit
        for name, value in {**own, **attributes}.items():
            file.attrs[name] = value


def read_whole(
    path: str | os.PathLike, kind: tuple[str, int], layout: Layout, made_by: str, assemble
):
    """What `assemble` makes of a file's attributes, its arrays and the lengths of their axes.

    Args:
        path: of the file.
        kind: format and schema version that are expected.
        layout: of the datasets.
        made_by: what writes such files, for the error.
        assemble: of (attributes, arrays, sizes); what it raises means a damaged file.

    Raises:
        FlowFileError: if the file is foreign, truncated, or of a newer schema.
    """

    def assembled(file):
        arrays = {name: file[name][...] for name in layout}
        return assemble(dict(file.attrs), arrays, _sizes(layout, arrays))

    return open_whole(path, kind, made_by, assembled)


def open_whole(path: str | os.PathLike, kind: tuple[str, int], made_by: str, assemble):
    """What `assemble` makes of an open file of that kind; arguments and errors of `read_whole`."""
    path = Path(path)
    try:
        with open(path, "rb") as file:
            signature = file.read(len(_SIGNATURE))
    except OSError as error:
        raise FlowFileError(f"{path}: cannot be read ({error.strerror}); check its name.") from None
    if signature != _SIGNATURE:
        raise FlowFileError(f"{path}: is not an HDF5 file; give one that {made_by} wrote.")
    try:
        with h5py.File(path, "r") as file:
            _check(path, dict(file.attrs), kind, made_by)
            return assemble(file)
    except FlowFileError:
        raise
    except ImportError as error:
        raise FlowFileError(
            f"{path}: names a class that is not here ({error}); put its module on the path."
        ) from None
    except (OSError, KeyError, ValueError, TypeError, AttributeError, RuntimeError):
        raise FlowFileError(
            f"{path}: is truncated or damaged and cannot be read; restore a copy or make it anew."
        ) from None


def _check(path: Path, attributes: Mapping[str, Any], kind: tuple[str, int], made_by: str) -> None:
    if attributes.get("format") != kind[0]:
        raise FlowFileError(
            f"{path}: is HDF5 but holds no {kind[0].removeprefix('jaxsph ')}; give a file that "
            f"{made_by} wrote."
        )
    version = int(attributes["schema_version"])
    if version > kind[1]:
        raise FlowFileError(
            f"{path}: has schema version {version}, this jaxsph_rom reads {kind[1]}; use "
            "the version that wrote it, or a newer one."
        )
    if version < kind[1]:
        raise FlowFileError(
            f"{path}: has schema version {version}, of an earlier jaxsph_rom; make it anew by "
            f"{made_by}."
        )


def _sizes(layout: Layout, arrays: Mapping[str, np.ndarray]) -> dict[str, int]:
    """The length of every axis; a ValueError if two datasets disagree."""
    sizes: dict[str, int] = {}
    for name, (axes, _) in layout.items():
        for axis, length in zip(axes.split(), arrays[name].shape, strict=True):
            if sizes.setdefault(axis, length) != length:
                raise ValueError(axis)
    return sizes
