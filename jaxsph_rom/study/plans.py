"""What is studied of each scene unless the user says otherwise."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from jaxsph.metrics import centre_line, vertical_slice
from jaxsph.scenes import Scene

from .local_bases import LocalBases
from .method import Experiment
from .recorded_run import Progress
from .settled import settled


@dataclass(frozen=True)
class Plan:
    """Reynolds numbers, modes and how runs are judged.

    Args:
        train, predict: Reynolds numbers to train on and to run at.
        modes: numbers of modes.
        tau: memory length of the adjoint Petrov-Galerkin projection [s].
        borders: of local bases over the Reynolds number; one global basis if none are given.
        slice_at: x of the vertical line of probes [m]; the centre line if none is given.
        judged_from: time from which on discrepancies count [s].
        hyper: what is compared, models on moving particles (none), on reference points (tensor).
        settling: time [s] that a run from rest takes before the studied time begins.
    """

    train: tuple[float, ...]
    predict: tuple[float, ...]
    modes: tuple[int, ...]
    tau: float
    borders: tuple[float, ...] | None = None
    slice_at: float | None = None
    judged_from: float = 0.0
    settling: float | None = None
    hyper: tuple[str, ...] = ("none",)

    def experiments(self) -> tuple[Experiment, ...]:
        """One experiment with a global basis, or one for each local basis.

        Raises:
            ValueError: as `LocalBases`.
        """
        if self.borders is None:
            return (Experiment(self.train, self.predict, self.modes),)
        return LocalBases(self.borders).experiments(self.train, self.predict, self.modes)

    def probes(self, scene: Scene) -> np.ndarray:
        """Where runs are compared (P, n) [m].

        Raises:
            ValueError: if the line is outside the scene's box.
        """
        if self.slice_at is None:
            return centre_line(scene.space)
        return vertical_slice(scene.space, self.slice_at)

    def scenes(
        self, make: Callable[..., Scene], folder: Path, progress: Progress
    ) -> Callable[[float], Scene]:
        """`make` as a function of the Reynolds number, settled first where the plan says so.

        Args:
            make: a scene from a Reynolds number, and from `start_time` where runs settle first.
            folder: where runs that settle are kept.
            progress: opens a progress bar for these.

        Raises:
            ValueError: if runs are to settle but the scene always starts from rest.
        """
        if self.settling is None:
            return make
        if "start_time" not in inspect.signature(make).parameters:
            raise ValueError("settling: this scene starts from rest; leave it out.")
        return settled(make, self.settling, folder / "settling", progress)


_DECAYING = Plan((100.0, 150.0, 200.0, 250.0), (125.0, 175.0, 225.0), (3,), 1e-4)
PLANS = {
    # the first thing that is run: at one unseen number, halfway between two of its training
    "taylor-green": dataclasses.replace(_DECAYING, predict=(175.0,), hyper=("none", "tensor")),
    "taylor-green-3d": _DECAYING,
    "lid-driven-cavity": Plan(
        (50.0, 100.0, 150.0, 200.0),
        (75.0, 125.0, 175.0),
        (15,),
        1e-7,
        borders=(50.0, 100.0, 150.0, 200.0),
        judged_from=1.0,  # before, pressure is that of sound from the lid's sudden start
    ),
    "open-cavity": Plan((2400.0,), (2400.0,), (20,), 1e-7, slice_at=0.25, settling=5.0),
}
