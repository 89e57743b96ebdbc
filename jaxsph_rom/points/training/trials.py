"""Reduced models of some of the training runs, judged by the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from jaxsph.integrate import SimulationError
from jaxsph.scenes import Scene

from ...reference import ReferenceSpace
from ..parameters.family import Training
from ..prediction.calibration import Calibration
from ..prediction.indicator import Indicator, Places, indicated, velocity_error
from ..prediction.reduced_flow import ReducedFlow
from .closure import ProjectedRun
from .formulation import Formulation
from .reduction import Reduction


class Project(NamedTuple):
    """What is the same for all numbers of modes."""

    training: Training
    reference: ReferenceSpace
    formulation: Formulation
    reduction: Reduction
    prepared: Any
    places: Places

    @property
    def first(self) -> Scene:
        return self.training.scenes[0]

    def flow(self, mapped: Sequence[np.ndarray], numbers: Sequence[int], basis):
        """The flow of some training runs in a basis, before closure and recovery, and these."""
        flow = ReducedFlow(self.reference, basis, None, self.first.fluid)
        runs = [
            ProjectedRun(self.training.values[k], np.asarray(flow.project(mapped[k])))
            for k in numbers
        ]
        dynamics = self.reduction.dynamics(self.prepared, self.first, basis, runs)
        return ReducedFlow(self.reference, basis, dynamics, self.first.fluid), runs


def left_out_of(project: Project, mapped, modes: int) -> tuple[Calibration, list[dict[str, float]]]:
    """The indicator's scale, and error and residual of each run by a model without it."""
    numbers = range(len(mapped))
    if len(mapped) < 2:
        return Calibration.of(project.training.points, [np.nan], [np.nan]), []
    found = []
    for k in numbers:
        others = [j for j in numbers if j != k]
        basis = project.formulation.basis(  # fewer runs may not give as many modes
            project.first, project.reference, [mapped[j] for j in others], None
        )
        basis = basis.truncated(min(modes, basis.size))
        flow, runs = project.flow(mapped, others, basis)
        flow = project.formulation.finished(flow, project.first, runs, [mapped[j] for j in others])
        found.append(_judged(flow, project, k, mapped[k]))
    return _calibrated(project, found), found


def scale_of_closed(flow, open_, project: Project, mapped, left_out) -> Calibration:
    """The scale of a closed flow: that of its own errors, and by how much leaving a run out makes
    the errors of the open flow larger; to leave runs out of the closure as well would cost its
    training once for each."""
    own = own_scale(flow, project, mapped)
    before = [_judged(open_, project, k, fields)["error"] for k, fields in enumerate(mapped)]
    pairs = [(found["error"], b) for found, b in zip(left_out, before, strict=False)]
    good = [a / b for a, b in pairs if np.isfinite(a) and np.isfinite(b) and a > 0.0 and b > 0.0]
    return own.times(max(1.0, float(np.exp(np.mean(np.log(good)))))) if good else own


def own_scale(flow, project: Project, mapped) -> Calibration:
    """The scale that the errors on the training runs themselves give."""
    found = [_judged(flow, project, k, fields) for k, fields in enumerate(mapped)]
    return _calibrated(project, found)


def _calibrated(project: Project, found: Sequence[dict[str, float]]) -> Calibration:
    errors, residuals = ([f[name] for f in found] for name in ("error", "residual"))
    return Calibration.of(project.training.points, errors, residuals)


def _judged(flow: ReducedFlow, project: Project, k: int, fields) -> dict[str, float]:
    """Error and residual of the reduced run at a training point."""
    start = flow.project(fields[..., 0])
    values = project.training.values[k]
    schedule = replace(project.first.schedule, intervals=fields.shape[-1] - 1)
    try:
        after = flow.predict(start, values, schedule)
    except SimulationError:
        return {"error": float("inf"), "residual": float("inf")}
    coordinates = np.concatenate([np.asarray(start)[None], after])
    point = project.training.points[k]
    dtype = flow.reference.points.dtype
    arguments = point[None], values[None], schedule.times, coordinates[None]
    indicator = Indicator.of(flow, project.places, Calibration.none(len(point)))
    residual = indicated(indicator, flow, *(jnp.asarray(a, dtype) for a in arguments))
    error = velocity_error(flow, coordinates, fields[:, 1:])
    return {"error": error, "residual": float(residual[0])}
