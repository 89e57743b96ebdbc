"""Reduced models on reference points beside the same full runs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxsph.integrate import Fault, SimulationError

from ..hyper import (
    Formulation,
    LinearClosure,
    TrainedFlow,
    formulation_for,
    mapped_run,
    sweep,
    train_flows,
)
from ..hyper.fixed_points import check_steady
from ..hyper.training import held_back, viscosity_of
from .study import Experiment, ModelBasis, Outcome, Study


class TensorStudy:
    """The experiments of a study by reduced flows on reference points.

    Every run starts from the projection of its full run's own start. A run takes milliseconds, so
    none is kept on disk.

    Args:
        study: makes and keeps the full runs.
        formulation: of the flows; what suits the scene if none is given.
        closed: whether flows have a linear closure.
        judge: Reynolds number of the training run that only judges it; chosen by `held_back` if
            none is given.
    """

    def __init__(
        self,
        study: Study,
        formulation: Formulation | None = None,
        closed: bool = False,
        judge: float | None = None,
    ):
        self.study, self.formulation, self.closed, self.judge = study, formulation, closed, judge

    def check(self, experiment: Experiment) -> None:
        """A ValueError if the experiment cannot be done on reference points."""
        if self.closed:
            self._closure(experiment)
        self.study.check(experiment)
        scene = self.study.scene(experiment.trained_on[0])
        check_steady(scene, scene.state.position)

    def run(self, experiment: Experiment) -> Iterator[Outcome]:
        """All reduced runs of an experiment, each compared with the full run."""
        self.check(experiment)
        study = self.study
        trained = train_flows(
            [study.scene(reynolds) for reynolds in experiment.trained_on],
            [study.full(reynolds) for reynolds in experiment.trained_on],
            experiment.modes,
            self._formulation(experiment),
            self._closure(experiment) if self.closed else None,
            study.progress,
        )
        for flow in trained:
            for reynolds in experiment.reynolds:
                yield self._reduced(experiment, reynolds, flow)

    def _formulation(self, experiment: Experiment) -> Formulation:
        if self.formulation is not None:
            return self.formulation
        scene = self.study.scene(experiment.trained_on[0])
        return formulation_for(scene, self.study.product, self.closed)

    def _closure(self, experiment: Experiment) -> LinearClosure:
        judge = held_back(experiment.trained_on) if self.judge is None else self.judge
        if judge is not None and judge not in experiment.trained_on:
            raise ValueError(
                f"held-back: Re {judge:g} is none of {list(experiment.trained_on)}; choose one of "
                "these."
            )
        return LinearClosure(judge)

    def _reduced(self, experiment: Experiment, reynolds: float, trained: TrainedFlow) -> Outcome:
        study, flow = self.study, trained.flow
        scene, full = study.scene(reynolds), study.full(reynolds)
        first = jax.tree.map(lambda field: field[:1], full)
        start = flow.project(mapped_run(flow.reference, first, scene.fluid))
        found = sweep(
            flow, start, np.array([viscosity_of(scene)]), scene.time_step,
            scene.steps_per_snapshot, len(full.time) - 1,
        )  # fmt: skip
        good = int(np.isfinite(found.coordinates[0]).all(axis=1).sum())  # none after a fault
        coordinates = jnp.concatenate([start, found.coordinates[0, :good]])
        time = full.time[: 1 + good]
        fault = None
        if good < len(full.time) - 1:
            fault = SimulationError(Fault(found.code[0], found.step[0], -1), scene.time_step)
        probed = flow.fields(coordinates, time, study.probes(reynolds))
        rest = {
            "modes": flow.basis.size,
            "projection": "galerkin",
            "tau": None,
            "hyper": _label(trained.training),
            "trained_on": tuple(experiment.trained_on),
            "rom_seconds": found.run_seconds if fault is None else None,
            "rom_compile_seconds": found.compile_seconds,
        }
        made_of = ModelBasis(rest["hyper"], rest["trained_on"], flow.basis, flow.reference)
        profile = np.linalg.norm(probed.velocity, axis=2), probed.pressure
        return study.judged(reynolds, flow.fields(coordinates, time), profile, fault, rest, made_of)


def _label(training: dict[str, Any]) -> str:
    """What kind of hyper-reduction a flow was trained with."""
    parts = ["tensor"]
    if training["formulation"] == "solenoidal":
        parts.append("solenoidal")
    if training["closure"] != "none":
        parts.append(f"{training['closure']} closure")
    return ", ".join(parts)
