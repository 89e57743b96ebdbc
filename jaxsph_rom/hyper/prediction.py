"""Runs of a reduced flow at many Reynolds numbers, and their file."""

from __future__ import annotations

import os
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from .whole_file import read_whole, write_whole

KIND = ("jaxsph prediction", 1)
_LAYOUT = {
    "reynolds": ("members", "1"),
    "time": ("times", "s"),
    "coordinates": ("members times modes", "as the modes of the reduced flow"),
    "status": ("members", "fault code; 0 for a good run"),
    "step": ("members", "of the fault; -1 for a good run"),
}


class Prediction(NamedTuple):
    """A member for each Reynolds number.

    Args:
        reynolds: (K,).
        time: of the snapshots, the start included (S,) [s].
        coordinates: (K, S, M); NaN from a member's fault on.
        status: a `FaultCode` each, 0 for a good run (K,).
        step: that met the fault, -1 for a good run (K,).
        run_seconds, compile_seconds: wall-clock time of all members together [s].
    """

    reynolds: Float[np.ndarray, " members"]
    time: Float[np.ndarray, " times"]
    coordinates: Float[np.ndarray, "members times modes"]
    status: Int[np.ndarray, " members"]
    step: Int[np.ndarray, " members"]
    run_seconds: float
    compile_seconds: float

    def good(self, member: int) -> int:
        """The number of a member's snapshots before its fault."""
        lost = np.isnan(self.coordinates[member]).any(axis=-1)
        return int(np.argmax(np.append(lost, True)))


def save_prediction(path: str | os.PathLike, prediction: Prediction, source: str) -> None:
    """Write a prediction to an HDF5 file, whole or not at all; a file that is there is replaced.

    Args:
        path: of the file.
        prediction: to write.
        source: name of the reduced flow's file, for the record.

    Raises:
        TrajectoryFileError: if the file cannot be written.
    """
    arrays = prediction._asdict()
    attributes = {name: arrays.pop(name) for name in ("run_seconds", "compile_seconds")}
    write_whole(path, KIND, _LAYOUT, arrays, {**attributes, "model": source})


def load_prediction(path: str | os.PathLike) -> Prediction:
    """The prediction in a file.

    Raises:
        FlowFileError: if the file is not a whole file of a prediction, or of a newer schema.
    """

    def assemble(attributes, arrays, sizes):
        seconds = (float(attributes[name]) for name in ("run_seconds", "compile_seconds"))
        return Prediction(*(arrays[name] for name in _LAYOUT), *seconds)

    return read_whole(path, KIND, _LAYOUT, "`jaxsph-rom predict`", assemble)
