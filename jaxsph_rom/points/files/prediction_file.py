"""A prediction as a file."""

from __future__ import annotations

import json
import os
from typing import Any

import jax.numpy as jnp
import numpy as np

from ..prediction.prediction import Maker, Prediction
from ..prediction.trained_model import TrainedModel
from .whole_file import read_whole, write_whole

KIND = ("jaxsph prediction", 2)
_LAYOUT = {
    "points": ("members names", "of each parameter its own"),
    "values": ("members coefficients", "of each coefficient its own"),
    "time": ("times", "s"),
    "coordinates": ("members times modes", "as the modes of the reduced model"),
    "status": ("members", "fault code; 0 for a good run"),
    "step": ("members", "of the fault; -1 for a good run"),
    "outside": ("members", "1 beyond the training points or their time"),
    "error_indicator": ("members", "1; expected relative error of velocity"),
}


def save_prediction(path: str | os.PathLike, prediction: Prediction, source: str) -> None:
    """Write a prediction to an HDF5 file, whole or not at all; a file that is there is replaced.

    Args:
        path: of the file.
        prediction: to write.
        source: name of the model's file, for the record.

    Raises:
        TrajectoryFileError: if the file cannot be written.
    """
    arrays = {name: np.asarray(getattr(prediction, name)) for name in _LAYOUT}
    attributes: dict[str, Any] = {
        name: getattr(prediction, name)
        for name in ("start", "operators", "run_seconds", "compile_seconds")
    }
    attributes |= {"names": json.dumps(prediction.names), "model": source}
    write_whole(path, KIND, _LAYOUT, arrays, attributes)


def load_prediction(path: str | os.PathLike, model: TrainedModel | None = None) -> Prediction:
    """The prediction in a file.

    Args:
        path: of the file.
        model: that made it, if fields are wanted.

    Raises:
        FlowFileError: if the file is not a whole file of a prediction, or of another schema.
    """

    def assemble(attributes, arrays, sizes):
        texts = {name: str(attributes[name]) for name in ("start", "operators")}
        seconds = {f"{n}_seconds": float(attributes[f"{n}_seconds"]) for n in ("run", "compile")}
        indicated = arrays.pop("error_indicator")
        return Prediction(
            names=tuple(json.loads(attributes["names"])),
            maker=None if model is None else Maker(model),
            indicated=jnp.asarray(indicated), **arrays, **texts, **seconds,
        )  # fmt: skip

    return read_whole(path, KIND, _LAYOUT, "`jaxsph-rom predict`", assemble)
