"""Reduced models on reference points."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any, final

import numpy as np

from jaxsph import Trajectory
from jaxsph.integrate import Fault, SimulationError

from ..basis import Energy, InnerProduct
from ..points import Family, Formulation, LinearClosure, TrainedModel, formulation_for, train_each
from ..points.prediction.reduced_flow import mapped_run
from ..points.training.linear_closure import held_back
from ..points.training.training import check_family
from .full_runs import FullRuns
from .method import Experiment, Method, ModelBasis, ReducedRun


@final
@dataclass(frozen=True)
class OnPoints(Method):
    """Reduced flows on points that stay.

    Every run starts from the projection of its full run's own start. A run takes milliseconds, so
    none is kept on disk.

    Args:
        formulation: of the flows; what suits the scene and the product if none is given.
        product: inner product of the modes.
        closed: whether flows have a linear closure.
        judge: Reynolds number of the training run that only judges it; chosen by `held_back` if
            none is given.
        family: of the scenes; that of the full runs if none is given.
    """

    formulation: Formulation | None = None
    product: InnerProduct = Energy()  # noqa: RUF009
    closed: bool = False
    judge: float | None = None
    family: Family | None = None

    @property
    def product_name(self):
        return type(self.product).__name__

    def check(self, runs, experiment):
        self.closure(experiment)
        check_family(self._family(runs), _parameters(experiment.trained_on))

    def run(self, runs, experiment):
        scene = runs.scene(experiment.trained_on[0])
        formulation = self.formulation
        if formulation is None:
            formulation = formulation_for(scene, self.product, self.closed)
        trained = train_each(
            self._family(runs),
            _parameters(experiment.trained_on),
            experiment.modes,
            runs=[runs.full(reynolds) for reynolds in sorted(experiment.trained_on, reverse=True)],
            formulation=formulation,
            closure=self.closure(experiment),
            progress=runs.progress,
        )
        for model in trained:
            for reynolds in experiment.reynolds:
                yield self._reduced(runs, experiment.trained_on, reynolds, model)

    def _family(self, runs: FullRuns) -> Family:
        return Family(lambda reynolds: runs.scene(reynolds)) if self.family is None else self.family

    def closure(self, experiment: Experiment) -> LinearClosure | None:
        """That of the flows, if they have one.

        Raises:
            ValueError: for a judge that is no training run, before anything is run.
        """
        if not self.closed:
            return None
        if self.judge is None:
            return LinearClosure(held_back(_parameters(experiment.trained_on)))
        if self.judge not in experiment.trained_on:
            raise ValueError(
                f"held-back: Re {self.judge:g} is none of {list(experiment.trained_on)}; choose "
                "one of these."
            )
        return LinearClosure({"reynolds": self.judge})

    def _reduced(self, runs, trained_on, reynolds: float, trained: TrainedModel) -> ReducedRun:
        flow, full = trained.flow, runs.full(reynolds)
        found = trained.predict({"reynolds": reynolds}, start=full.state(0))
        fault = None
        if found.good(0) < len(full.time):
            step = runs.scene(reynolds).time_step
            fault = SimulationError(Fault(found.status[0], found.step[0], -1), step)
        scene, probes = runs.scene(reynolds), runs.probes(reynolds)
        probed = found.fields(0, probes)
        coordinates = flow.project(mapped_run(flow.reference, full, scene.fluid))
        projected = flow.fields(coordinates, full.time, probes, scene.fluid)
        told = {
            "modes": flow.basis.size,
            "projection": "galerkin",
            "tau": None,
            "hyper": _label(trained.training),
            "trained_on": trained_on,
            "rom_seconds": found.run_seconds if fault is None else None,
            "rom_compile_seconds": found.compile_seconds,
            "offline_seconds": trained.training["offline_seconds"]
            + trained.training.get("closure_seconds", 0.0),
        }
        made_of = partial(self._made_of, runs, trained_on, flow)
        return ReducedRun(
            reynolds, found.fields(0), _profile(probed), fault, told, made_of, trained,
            _profile(projected),
        )  # fmt: skip

    def _made_of(self, runs: FullRuns, trained_on, flow) -> ModelBasis:
        lagrangian = runs.lagrangian_basis(trained_on, self.product)
        return ModelBasis(flow.basis, lagrangian, flow.reference, {})


def _profile(probed: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    """Velocity norm and pressure over time, each (S, P)."""
    return np.linalg.norm(probed.velocity, axis=2), probed.pressure


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
