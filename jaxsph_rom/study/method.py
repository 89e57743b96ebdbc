"""What a study compares: ways of making reduced models of full runs."""

from __future__ import annotations

import abc
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from jaxsph import SimulationError, Trajectory

from ..basis import Basis
from ..points import TrainedModel
from ..reference import ReferenceSpace
from .full_runs import FullRuns


@dataclass(frozen=True)
class Experiment:
    """Reynolds numbers to train on, those to run the reduced model at, and numbers of modes.

    A Reynolds number that is trained on is reconstructed, any other is predicted.
    """

    trained_on: tuple[float, ...]
    reynolds: tuple[float, ...]
    modes: tuple[int, ...]


@dataclass(frozen=True)
class ModelBasis:
    """What reduced models are made of, for the report.

    Args:
        basis: of the models.
        lagrangian: of the same runs in Lagrangian space.
        reference: the points of the modes, and the map to them.
        settings: choices that the report names.
    """

    basis: Basis
    lagrangian: Basis
    reference: ReferenceSpace
    settings: dict[str, Any]


@dataclass(frozen=True)
class ReducedRun:
    """A reduced run, before it is judged.

    Args:
        reynolds: it is run at.
        trajectory: as far as it came.
        profile: velocity norm and pressure on the probes over time, each (S, P).
        fault: that ended it, if any.
        told: values of the report's `Case` that only the method knows.
        made_of: tells what the model is made of.
        model: that runs at any parameters, where the method makes one.
        projected: `profile` of the full run as the basis can hold it, where the method knows it.
    """

    reynolds: float
    trajectory: Trajectory
    profile: tuple[np.ndarray, np.ndarray]
    fault: SimulationError | None
    told: dict[str, Any]
    made_of: Callable[[], ModelBasis]
    model: TrainedModel | None = None
    projected: tuple[np.ndarray, np.ndarray] | None = None


class Method(abc.ABC):
    """A way of making reduced models of full runs, and of running them."""

    @property
    @abc.abstractmethod
    def product_name(self) -> str:
        """The inner product of the models, as reports name it."""

    @abc.abstractmethod
    def check(self, runs: FullRuns, experiment: Experiment) -> None:
        """A ValueError if the experiment cannot be done, before any run."""

    @abc.abstractmethod
    def run(self, runs: FullRuns, experiment: Experiment) -> Iterator[ReducedRun]:
        """Train on the full runs, and run all of an experiment."""
