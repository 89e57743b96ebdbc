"""What a reduced model gets wrong on the runs that it was trained on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from jaxsph.integrate import SimulationError
from jaxsph.metrics import relative_discrepancy

from ...pressure_noise import is_noise
from ..dynamics.log_density import from_log_density
from ..parameters.family import Training
from ..prediction.reduced_flow import ReducedFlow
from .closure import ProjectedRun

_UNIFORM = 1e-3  # of the largest spread over the points that a field has at any time


def training_errors(
    flow: ReducedFlow,
    training: Training,
    projected: Sequence[ProjectedRun],
    mapped: Sequence[Float[np.ndarray, "points fields times"]],
) -> list[dict[str, Any]]:
    """Errors of the projection and of the reduced run, or its fault, at each training point.

    Percent relative discrepancy of velocity norm and pressure over the reference points, peak and
    median over time.
    """
    found, first = [], training.scenes[0]
    for k, (run, fields) in enumerate(zip(projected, mapped, strict=True)):
        fluid = training.scenes[k].fluid
        density = from_log_density(jnp.asarray(fields[:, 0].T), fluid)
        speed = np.linalg.norm(fields[:, 1:], axis=1).T
        truth = speed, np.asarray(fluid.pressure(density))
        row: dict[str, Any] = {"parameters": training.named(training.points[k])}
        row["floor"] = discrepancies(flow, fluid, run.coordinates, truth)
        try:
            schedule = replace(first.schedule, intervals=len(run.coordinates) - 1)
            after = flow.predict(jnp.asarray(run.coordinates[0]), run.values, schedule)
        except SimulationError as error:
            row["errors"] = str(error)
        else:
            after = np.concatenate([run.coordinates[:1], after])
            row["errors"] = discrepancies(flow, fluid, after, truth)
        found.append(row)
    return found


def discrepancies(flow: ReducedFlow, fluid, coordinates, truth) -> dict[str, float | None]:
    """Peak and median over time of the discrepancy over all reference points.

    Times at which a field is all but uniform, as at a start from rest, have no relative one, and a
    pressure that is uniform but for noise at all times has none at all; that in pascal it has.
    """
    fields = flow.fields(coordinates, np.arange(len(coordinates)), fluid=fluid)
    values = np.linalg.norm(fields.velocity, axis=2), fields.pressure
    found = {}
    for name, mine, theirs in zip(("velocity", "pressure"), values, truth, strict=True):
        spread = np.ptp(theirs, axis=1)
        judged = spread > _UNIFORM * spread.max()
        percent = np.zeros(1)
        if judged.any():
            percent = relative_discrepancy(theirs[judged], mine[judged])
        found[f"{name}_peak_percent"] = float(percent.max())
        found[f"{name}_median_percent"] = float(np.median(percent))
    apart = np.abs(truth[1] - values[1]).mean(axis=1)
    found["pressure_peak_pascal"] = float(apart.max())
    found["pressure_median_pascal"] = float(np.median(apart))
    if is_noise(truth[1], fluid):
        found["pressure_peak_percent"] = found["pressure_median_percent"] = None
    return found
