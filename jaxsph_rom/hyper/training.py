"""From full runs to trained flows."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, final

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsph import Trajectory
from jaxsph.arrangements import Lattice
from jaxsph.effects import IsotropicViscosity, LaminarViscosity
from jaxsph.integrate import SimulationError
from jaxsph.interpolation import MovingLeastSquaresMap
from jaxsph.metrics import relative_discrepancy
from jaxsph.scenes import Scene

from ..reference import ReferenceSpace
from .closure import ProjectedRun, fit_linear_closure
from .formulation import Compressible, Formulation
from .log_density import from_log_density
from .reduced_flow import ReducedFlow, mapped_run
from .trained_flow import TrainedFlow

_UNIFORM = 1e-3  # of the largest spread over the points that a field has at any time
# label and iterations -> context manager that gives a function to report iterations to
Progress = Callable[[str, int, int], AbstractContextManager[Callable[[int], None]]]


@final
@dataclass(frozen=True)
class LinearClosure:
    """That a trained flow shall have a linear closure, as `fit_linear_closure` makes it.

    Args:
        held_back: Reynolds number of a training run that only judges, if there is one.
        window: intervals between snapshots in a window, if runs are so long.
        iterations: of the training.
        learning_rate: at the start.
    """

    held_back: float | None = None
    window: int = 50
    iterations: int = 600
    learning_rate: float = 0.02

    def __post_init__(self):
        if self.window < 1 or self.iterations < 1:
            raise ValueError(
                f"closure: window and iterations must be at least 1, got {self.window} and "
                f"{self.iterations}."
            )
        if not self.learning_rate > 0.0:
            raise ValueError(
                f"closure: the learning rate must be positive, got {self.learning_rate}."
            )


def held_back(reynolds: Sequence[float]) -> float | None:
    """The training run that had best judge a closure: an inner one of four or more, else none."""
    inner = sorted(reynolds)[1:-1]
    return inner[-1] if len(inner) >= 2 else None


def reference_points(scene: Scene) -> Float[Array, "points dim"]:
    """Reference points of a scene: a lattice, within walls that of the particles at the start."""
    return Lattice().positions(scene.space) if scene.walls is None else scene.state.position


def train_flows(
    scenes: Sequence[Scene],
    runs: Sequence[Trajectory],
    modes: Sequence[int],
    formulation: Formulation | None = None,
    closure: LinearClosure | None = None,
    progress: Progress | None = None,
) -> Iterator[TrainedFlow]:
    """A trained flow for each number of modes; runs are mapped and projected once.

    Its `training` tells what it took, `offline_seconds` to map, decompose and project and
    `closure_seconds`, and what errors are left on its own runs, by Reynolds number: percent
    relative discrepancy of velocity norm and pressure over the reference points, peak and median
    over time, `floor` of the projection alone and `errors` of the reduced run, or its fault.

    Args:
        scenes: of the runs; they differ in their Reynolds number.
        runs: of the full model.
        modes: numbers of modes.
        formulation: `Compressible()` if none is given.
        closure: to learn, if any.
        progress: opens a progress bar for the closure.

    Raises:
        ValueError: if the scenes do not fit together, as `ReferenceSpace.snapshots` and the
            formulation, or as `fit_linear_closure`.
    """
    order = np.argsort([viscosity_of(scene) for scene in scenes])
    scenes, runs = [scenes[k] for k in order], [runs[k] for k in order]
    product_of_scales = _check(scenes, closure)
    first = scenes[0]
    before = clock.perf_counter()
    formulation = Compressible() if formulation is None else formulation
    reference = ReferenceSpace(reference_points(first), first.space, MovingLeastSquaresMap)
    mapped = [mapped_run(reference, run, first.fluid) for run in runs]
    largest = jax.block_until_ready(formulation.flow(first, reference, mapped, max(modes)))
    offline = clock.perf_counter() - before
    for count in modes:
        flow = largest.truncated(count)
        projected = [
            ProjectedRun(viscosity_of(scene), np.asarray(flow.project(fields)))
            for scene, fields in zip(scenes, mapped, strict=True)
        ]
        made: dict[str, Any] = {"trained_on": [_reynolds(scene) for scene in reversed(scenes)]}
        made |= {"formulation": formulation.name}
        made |= {"offline_seconds": offline, "closure": "none"}
        if closure is not None:
            flow, learnt = _closed(flow, scenes, projected, closure, progress)
            made |= learnt
        flow = formulation.finished(flow, first, projected, mapped)
        made |= _errors(flow, scenes, projected, mapped)
        yield TrainedFlow(
            flow,
            np.asarray([run.viscosity for run in projected]),
            np.stack([run.coordinates[0] for run in projected]),
            speed_times_length=product_of_scales,
            time_step=first.time_step,
            steps_per_snapshot=first.steps_per_snapshot,
            snapshots=len(runs[0].time) - 1,
            scene=first.name,
            parameters=first.parameters,
            training=made,
        )


def viscosity_of(scene: Scene) -> float:
    """nu of a scene [m^2/s].

    Raises:
        ValueError: if nothing in it is viscous.
    """
    for effect in scene.effects:
        if isinstance(effect, LaminarViscosity | IsotropicViscosity):
            return float(effect.viscosity)
    raise ValueError(f"scene: {scene.name} has no viscosity, so no Reynolds number to run at.")


def _reynolds(scene: Scene) -> float:
    return float(scene.parameters["reynolds"])


def _check(scenes: Sequence[Scene], closure: LinearClosure | None) -> float:
    """U L of the scenes [m^2/s]; a ValueError if they do not fit together."""
    if not scenes:
        raise ValueError("runs: a flow needs at least one run to be trained on.")
    numbers = [_reynolds(scene) for scene in scenes]
    if len(set(numbers)) < len(numbers):
        raise ValueError(f"runs: their Reynolds numbers must differ, got {numbers}.")
    for name in ("name", "space", "time_step", "steps_per_snapshot", "steps"):
        if any(getattr(scene, name) != getattr(scenes[0], name) for scene in scenes):
            raise ValueError(
                f"runs: differ in {name.replace('_', ' ')}; make them with the same settings but "
                "for the Reynolds number."
            )
    scales = [_reynolds(scene) * viscosity_of(scene) for scene in scenes]
    if not np.allclose(scales, scales[0], rtol=1e-5):
        raise ValueError("runs: differ in U L = Re nu; make them at the same speed and length.")
    if closure is not None and closure.held_back is not None:
        if closure.held_back not in numbers:
            raise ValueError(
                f"held-back: Re {closure.held_back:g} is none of {numbers}; choose one of these."
            )
        if len(numbers) < 2:
            raise ValueError("held-back: nothing is left to learn from; give more training runs.")
    return scales[0]


def _closed(flow, scenes, projected, closure, progress) -> tuple[ReducedFlow, dict[str, Any]]:
    """The flow with a closure, and how that was learnt."""
    by_reynolds = dict(zip(map(_reynolds, scenes), projected, strict=True))
    judge = by_reynolds.pop(closure.held_back, None)
    before = clock.perf_counter()

    def fit(report):
        return fit_linear_closure(
            flow.system,
            list(by_reynolds.values()),
            scenes[0].time_step,
            scenes[0].steps_per_snapshot,
            held_back=judge,
            window=min(closure.window, len(projected[0].coordinates) - 1),
            iterations=closure.iterations,
            learning_rate=closure.learning_rate,
            progress=report,
        )

    if progress is None:
        fitted = fit(None)
    else:
        label = f"closure, M = {flow.basis.size}"
        with progress(label, closure.iterations, 0) as report:
            fitted = fit(report)
    learnt = {
        "closure": "linear",
        "closure_seconds": clock.perf_counter() - before,
        "held_back": closure.held_back,
        "iterations": closure.iterations,
        "loss": fitted.training[-1],
        "held_back_loss": None if fitted.validation is None else min(fitted.validation),
    }
    return eqx.tree_at(lambda f: f.system, flow, fitted.system), learnt


def _errors(flow: ReducedFlow, scenes, projected, mapped) -> dict[str, Any]:
    """Errors on the training runs: of the projection, and of the reduced run."""
    found: dict[str, Any] = {"floor": {}, "errors": {}}
    for scene, run, fields in reversed(list(zip(scenes, projected, mapped, strict=True))):
        number = f"{_reynolds(scene):.12g}"
        density = from_log_density(jnp.asarray(fields[:, 0].T), flow.fluid)
        speed = np.linalg.norm(fields[:, 1:], axis=1).T
        truth = speed, np.asarray(flow.fluid.pressure(density))
        found["floor"][number] = _discrepancies(flow, run.coordinates, truth)
        try:
            after = flow.predict(
                jnp.asarray(run.coordinates[0]),
                run.viscosity,
                scene.time_step,
                scene.steps_per_snapshot,
                len(run.coordinates) - 1,
            )
        except SimulationError as error:
            found["errors"][number] = str(error)
            continue
        after = np.concatenate([run.coordinates[:1], after])
        found["errors"][number] = _discrepancies(flow, after, truth)
    return found


def _discrepancies(flow: ReducedFlow, coordinates, truth) -> dict[str, float]:
    """Peak and median over time of the discrepancy over all reference points.

    Times at which a field is all but uniform, as at a start from rest, have no relative one.
    """
    fields = flow.fields(coordinates, np.arange(len(coordinates)))
    values = np.linalg.norm(fields.velocity, axis=2), fields.pressure
    found = {}
    for name, mine, theirs in zip(("velocity", "pressure"), values, truth, strict=True):
        spread = np.ptp(theirs, axis=1)
        judged = spread > _UNIFORM * spread.max()
        percent = relative_discrepancy(theirs[judged], mine[judged])
        found[f"{name}_peak_percent"] = float(percent.max())
        found[f"{name}_median_percent"] = float(np.median(percent))
    return found
