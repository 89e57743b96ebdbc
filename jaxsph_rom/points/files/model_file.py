"""A trained model as a file that needs nothing else."""

from __future__ import annotations

import dataclasses
import json
import os
from typing import Any, TypeVar

import h5py
import jax
import numpy as np

from jaxsph.environment import versions
from jaxsph.io import whole_file

from ..prediction.trained_model import TrainedModel
from .object_tree import read, write
from .whole_file import FlowFileError, open_whole

T = TypeVar("T")
FORMAT, SCHEMA_VERSION = "jaxsph reduced flow", 4


def save(path: str | os.PathLike, model: TrainedModel) -> None:
    """Write a trained model to an HDF5 file, whole or not at all; a file that is there is replaced.

    The file is the model's tree: a group for each object, with the import path of its class, a
    dataset for each array. Effects of one's own are found again by their import path; the family's
    `make` is not kept, but what is known of it is (`TrainedModel`).

    Raises:
        ValueError: if an effect, a region or a function could not be found again from the file.
        TrajectoryFileError: if the file cannot be written.
    """
    write_tree(path, (FORMAT, SCHEMA_VERSION), dataclasses.replace(model, source=None))


def write_tree(path: str | os.PathLike, kind: tuple[str, int], model: Any) -> None:
    """Write a model's tree to a file of a kind, its format and schema version."""
    with whole_file(path) as file:
        file.attrs["format"], file.attrs["schema_version"] = kind
        file.attrs["units"], file.attrs["versions"] = "SI", json.dumps(versions())
        write(file, "model", model)


def load(path: str | os.PathLike) -> TrainedModel:
    """The trained model in a file.

    Raises:
        FlowFileError: if the file is not a whole file of a trained model, of another schema, or
            needs double precision that JAX has not been told to use.
    """

    return read_tree(path, (FORMAT, SCHEMA_VERSION), "`jaxsph-rom train`", TrainedModel)


def read_tree(path: str | os.PathLike, kind: tuple[str, int], made_by: str, wanted: type[T]) -> T:
    """The model in a file of a kind; errors as `load`."""

    def assembled(file):
        double = []
        file.visititems(lambda _, part: double.append(part) if _is_double(part) else None)
        if double and not jax.config.jax_enable_x64:
            raise FlowFileError(
                f"{path}: is in double precision; load it within jax.enable_x64(True), or train "
                "in single precision."
            )
        model = read(file, "model")
        if not isinstance(model, wanted):
            raise ValueError("model")
        return model

    return open_whole(path, kind, made_by, assembled)


def _is_double(part) -> bool:
    return (
        isinstance(part, h5py.Dataset)
        and part.dtype == np.float64
        and part.attrs.get("kind") == "jax"
    )
