"""Reduced models on reference points beside the same full runs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from jaxsph.integrate import Fault, SimulationError

from ..points import Family, Formulation, LinearClosure, TrainedModel, formulation_for, train_each
from ..points.training.linear_closure import held_back
from ..points.training.training import check_family
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
        family: of the study's scenes; their own if none is given.
    """

    def __init__(
        self,
        study: Study,
        formulation: Formulation | None = None,
        closed: bool = False,
        judge: float | None = None,
        family: Family | None = None,
    ):
        self.study, self.formulation, self.closed = study, formulation, closed
        self.judge = judge
        self.family = Family(lambda reynolds: study.scene(reynolds)) if family is None else family

    def check(self, experiment: Experiment) -> None:
        """A ValueError if the experiment cannot be done on reference points."""
        if self.closed:
            self._closure(experiment)
        self.study.check(experiment)
        check_family(self.family, _parameters(experiment.trained_on))

    def run(self, experiment: Experiment) -> Iterator[Outcome]:
        """All reduced runs of an experiment, each compared with the full run."""
        self.check(experiment)
        study = self.study
        trained = train_each(
            self.family,
            _parameters(experiment.trained_on),
            experiment.modes,
            runs=[study.full(reynolds) for reynolds in sorted(experiment.trained_on, reverse=True)],
            formulation=self._formulation(experiment),
            closure=self._closure(experiment) if self.closed else None,
            progress=study.progress,
        )
        for flow in trained:
            for reynolds in experiment.reynolds:
                yield self._reduced(experiment, reynolds, flow)

    def _formulation(self, experiment: Experiment) -> Formulation:
        if self.formulation is not None:
            return self.formulation
        scene = self.study.scene(experiment.trained_on[0])
        return formulation_for(scene, self.study.method.product, self.closed)

    def _closure(self, experiment: Experiment) -> LinearClosure:
        if self.judge is None:
            return LinearClosure(held_back(_parameters(experiment.trained_on)))
        if self.judge not in experiment.trained_on:
            raise ValueError(
                f"held-back: Re {self.judge:g} is none of {list(experiment.trained_on)}; choose "
                "one of these."
            )
        return LinearClosure({"reynolds": self.judge})

    def _reduced(self, experiment: Experiment, reynolds: float, trained: TrainedModel) -> Outcome:
        study, flow = self.study, trained.flow
        scene, full = study.scene(reynolds), study.full(reynolds)
        found = trained.predict({"reynolds": reynolds}, start=full.state(0))
        good = found.good(0)
        fault = None
        if good < len(full.time):
            fault = SimulationError(Fault(found.status[0], found.step[0], -1), scene.time_step)
        probed = found.fields(0, study.probes(reynolds))
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
        return study.judged(reynolds, found.fields(0), profile, fault, rest, made_of)


def _label(training: dict[str, Any]) -> str:
    """What kind of hyper-reduction a flow was trained with."""
    parts = ["tensor"]
    if training["formulation"] == "solenoidal":
        parts.append("solenoidal")
    if training["closure"] != "none":
        parts.append(f"{training['closure']} closure")
    return ", ".join(parts)


def _parameters(reynolds) -> list[dict[str, float]]:
    return [{"reynolds": number} for number in sorted(reynolds, reverse=True)]
