"""From a family of scenes to trained models."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from typing import Any

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Array, Float

from jaxsph import Trajectory, run_scene
from jaxsph.arrangements import Lattice
from jaxsph.interpolation import MovingLeastSquaresMap
from jaxsph.scenes import Scene

from ...basis import Energy
from ...reference import ReferenceSpace
from ..dynamics.eulerian_rates import EulerianRates
from ..parameters.family import Family, Training
from ..parameters.laws import Between, Law
from ..prediction.indicator import Indicator, Places
from ..prediction.reduced_flow import ReducedFlow, mapped_run
from ..prediction.trained_model import TrainedModel, projected_start
from .belonging import check_runs
from .closure import fit_linear_closure
from .formulation import Compressible, Formulation
from .linear_closure import LinearClosure
from .reduction import Reduction, Tensors
from .training_errors import training_errors
from .trials import Project, left_out_of, own_scale, scale_of_closed

# label and iterations -> context manager that gives a function to report iterations to
Progress = Callable[[str, int, int], AbstractContextManager[Callable[[int], None]]]


def train(
    make: Callable[..., Scene] | Family,
    parameters: Sequence[Mapping[str, Any]],
    modes: int = 10,
    *,
    runs: Sequence[Trajectory] | None = None,
    closure: LinearClosure | None = None,
    formulation: Formulation | None = None,
    reduction: Reduction | None = None,
    progress: Progress | None = None,
) -> TrainedModel:
    """A reduced model of `make(**parameters)`, a scene of any named parameters.

    Full runs are made at the training points, or taken as they are given. What the scenes'
    operators and starts make of the parameters is found, not assumed (`TrainedModel`), and all
    that can be refused is refused before a full run is made.

    Its `training` tells what that took, `offline_seconds` to map, decompose and project and
    `closure_seconds`, and what errors are left on its own runs: percent relative discrepancy of
    velocity norm and pressure over the reference points, peak and median over time, `floor` of
    the projection alone and `errors` of the reduced run, or its fault.

    Args:
        make: a function of named parameters that gives a scene.
        parameters: of each training run, a dictionary of numbers.
        modes: how many.
        runs: of the full model, one for each, where they exist.
        closure: to learn, if any.
        formulation: `Compressible()` if none is given; between walls and without a closure
            `Solenoidal()` has the better pressure, and the worse velocity where flows are far from
            steady (`benchmarks.walled_rom`).
        reduction: `Tensors()` if none is given; `Samples()` for effects that are not quadratic.
        progress: opens a progress bar for each full run and for the closure.

    Raises:
        ValueError: if scenes differ in what no model can follow, or have effects that the
            reduction does not know; if runs are not those of the scenes; or for more modes than
            snapshots.
        SimulationError: if a full run fails.

    Examples:
        >>> import dataclasses, jaxsph, jaxsph_rom
        >>> from jaxsph.arrangements import Lattice
        >>> from jaxsph.effects import LaminarViscosity, Gravity
        >>> def make(viscosity, force):
        ...     scene = jaxsph.scenes.taylor_green(16, end_time=0.06, arrangement=Lattice())
        ...     others = [e for e in scene.effects if e.name != "LaminarViscosity"]
        ...     own = (LaminarViscosity(viscosity), Gravity([force, 0.0]))
        ...     return dataclasses.replace(scene, effects=(*others, *own))
        >>> points = [{"viscosity": v, "force": f} for v, f in ((0.01, 0.5), (0.02, 1.0))]
        >>> trained = jaxsph_rom.train(make, points, modes=5)
        >>> prediction = trained.predict({"viscosity": 0.015, "force": 0.9})
        >>> round(float(prediction.fields(0).velocity[-1, :, 0].mean()), 3)  # 0.9 * 0.06
        0.054
    """
    return next(
        train_each(
            make, parameters, (modes,), runs=runs, closure=closure, formulation=formulation,
            reduction=reduction, progress=progress,
        )
    )  # fmt: skip


def reference_points(scene: Scene) -> Float[Array, "points dim"]:
    """Reference points of a scene: a lattice, within walls that of the particles at the start."""
    return Lattice().positions(scene.space) if scene.walls is None else scene.state.position


def check_family(
    make: Callable[..., Scene] | Family,
    parameters: Sequence[Mapping[str, Any]],
    modes: Sequence[int] = (1,),
    closure: LinearClosure | None = None,
    reduction: Reduction | None = None,
) -> None:
    """The ValueError that `train` would raise before a full run, if it would."""
    training = Training(make if isinstance(make, Family) else Family(make), parameters)
    _check(training, modes, closure, None)
    _prepared(training, Tensors() if reduction is None else reduction)


def _prepared(training: Training, reduction: Reduction) -> tuple[ReferenceSpace, Any]:
    """Reference space, and what the reduction knows before any run."""
    first = training.scenes[0]
    reference = ReferenceSpace(reference_points(first), first.space, MovingLeastSquaresMap)
    found = reduction.prepared(first, reference.points, training.coefficients, training.values)
    return reference, found


def train_each(
    make: Callable[..., Scene] | Family,
    parameters: Sequence[Mapping[str, Any]],
    modes: Sequence[int],
    *,
    runs: Sequence[Trajectory] | None = None,
    closure: LinearClosure | None = None,
    formulation: Formulation | None = None,
    reduction: Reduction | None = None,
    progress: Progress | None = None,
) -> Iterator[TrainedModel]:
    """`train` for several numbers of modes; runs are made, mapped and decomposed once."""
    kinds = {"closure": LinearClosure, "formulation": Formulation, "reduction": Reduction}
    given = (closure, formulation, reduction)
    for (name, kind), value in zip(kinds.items(), given, strict=True):
        if value is not None and not isinstance(value, kind):
            raise ValueError(f"{name}: an object of a {kind.__name__}, got {value!r}.")
    family = make if isinstance(make, Family) else Family(make)
    training = Training(family, parameters)
    first = training.scenes[0]
    _check(training, modes, closure, runs)
    if formulation is None:
        formulation = Compressible(Energy())
    reduction = Tensors() if reduction is None else reduction
    before = clock.perf_counter()
    reference, prepared = _prepared(training, reduction)
    offline = clock.perf_counter() - before
    if runs is None:
        runs = [_run(scene, training, k, progress) for k, scene in enumerate(training.scenes)]
    before = clock.perf_counter()
    rates = EulerianRates.of(
        training.functionals[0], reference.points, training.coefficients, listed=False
    )
    places = Places.among(rates)
    project = Project(training, reference, formulation, reduction, prepared, places)
    mapped = [mapped_run(reference, run, first.fluid) for run in runs]
    largest = formulation.basis(first, reference, mapped, max(modes))
    offline += clock.perf_counter() - before
    seconds = {"offline_seconds": offline, "full_seconds": _full_seconds(runs)}
    for count in modes:
        yield _trained(project, mapped, largest.truncated(count), closure, progress, seconds)


def _full_seconds(runs: Sequence[Trajectory]) -> float | None:
    """Run time of all full runs [s], also where one was taken up again; None if it is not known."""
    seconds = 0.0
    for run in runs:
        if "run_seconds" not in run.metadata:
            return None
        seconds += run.timing.seconds(round(float(run.time[-1]) / run.timing.time_step))
    return seconds


def _trained(
    project: Project, mapped, basis, closure: LinearClosure | None, progress, seconds
) -> TrainedModel:
    training, first = project.training, project.first
    everything = range(len(mapped))
    before = clock.perf_counter()
    flow, runs = jax.block_until_ready(project.flow(mapped, everything, basis))
    made: dict[str, Any] = {
        "trained_on": [training.named(point) for point in training.points],
        "formulation": project.formulation.name,
        "reduction": project.reduction.name,
        "coefficients": list(training.coefficients.names),
        "closure": "none",
    }
    scale, left_out = left_out_of(project, mapped, basis.size)
    made |= seconds
    made["offline_seconds"] += clock.perf_counter() - before
    if closure is None:
        flow = project.formulation.finished(flow, first, runs, mapped)
    else:
        open_ = project.formulation.finished(flow, first, runs, mapped)
        flow, learnt = _closed(flow, training, first, runs, closure, progress)
        made |= learnt
        flow = project.formulation.finished(flow, first, runs, mapped)
        scale = scale_of_closed(flow, open_, project, mapped, left_out)
    made["runs"] = training_errors(flow, training, runs, mapped)
    if not left_out and not scale.known:
        scale = own_scale(flow, project, mapped)
    made["left_out"] = left_out
    starts = np.stack([run.coordinates[0] for run in runs])
    between = training.points, training.values[: len(training.points)]
    law = Law.find(training.known, training.values)
    made["law"] = law is not None
    made["interpolation_error"] = None if law is not None else Between.of(*between).left_out
    return TrainedModel(
        flow, training.functionals[0], training.coefficients, training.names, training.points,
        law, Between.of(*between), _start_law(flow, training, starts),
        Between.of(training.points, starts), Indicator.of(flow, project.places, scale),
        schedule=replace(first.schedule, intervals=len(runs[0].coordinates) - 1), scene=first.name,
        parameters=first.parameters, training=made, source=training,
    )  # fmt: skip


def _start_law(flow: ReducedFlow, training: Training, starts) -> Law | None:
    if not training.family.starts:
        return None
    scenes = [*training.scenes, *training.probes]
    found = np.stack([np.asarray(projected_start(flow, scene)) for scene in scenes])
    largest = np.abs(found).max(initial=0.0)
    return Law.find(training.known, found, np.full(found.shape[1], largest))


def _run(scene: Scene, training: Training, k: int, progress: Progress | None) -> Trajectory:
    label = "full model, " + _label(training, k)
    opened = nullcontext(None) if progress is None else progress(label, scene.steps, 0)
    with opened as report:
        return run_scene(scene, progress=report)


def _label(training: Training, k: int) -> str:
    named = training.named(training.points[k])
    return ", ".join(f"{name} = {value:g}" for name, value in named.items())


def _check(training: Training, modes, closure: LinearClosure | None, runs) -> None:
    """A ValueError for what is known to fail before a full run."""
    first, count = training.scenes[0], len(training.scenes)
    available = _starts(training.scenes) + count * first.schedule.intervals
    for wanted in modes:
        if isinstance(wanted, bool) or not isinstance(wanted, int | np.integer) or wanted < 1:
            raise ValueError(f"modes: a number from 1 on, got {wanted!r}.")
        if wanted > available:
            raise ValueError(
                f"modes: {wanted} asked for, but the training runs give {available} different "
                "snapshots at most, rest apart; ask for fewer modes, a longer run or more runs."
            )
    if closure is not None and closure.held_back is not None:
        if dict(closure.held_back) not in [training.named(p) for p in training.points]:
            raise ValueError(
                f"held_back: {dict(closure.held_back)} is no training point; choose one of these."
            )
        if count < 2:
            raise ValueError("held_back: nothing is left to learn from; give more training runs.")
    if runs is not None:
        check_runs(training.scenes, runs, lambda k: _label(training, k))
    else:
        for scene in training.scenes:
            scene.search()  # what the box is too small for


def _starts(scenes: Sequence[Scene]) -> int:
    """How many different starts there are; rest is none, as the modes are about it."""
    states = (np.concatenate([s.state.density[:, None], s.state.velocity], 1) for s in scenes)
    return len({state.tobytes() for state in states if np.ptp(state, axis=0).any()})


def _closed(flow, training, scene, projected, closure, progress):
    """The flow with a closure, and how that was learnt."""
    held = None if closure.held_back is None else dict(closure.held_back)
    pairs = list(zip([training.named(p) for p in training.points], projected, strict=True))
    judge = next((run for named, run in pairs if named == held), None)
    before = clock.perf_counter()
    label = f"closure, M = {flow.basis.size}"
    opened = nullcontext(None) if progress is None else progress(label, closure.iterations, 0)
    with opened as report:
        fitted = fit_linear_closure(
            flow.system,
            [run for named, run in pairs if named != held],
            scene.time_step,
            scene.steps_per_snapshot,
            held_back=judge,
            window=min(closure.window, len(projected[0].coordinates) - 1),
            iterations=closure.iterations,
            learning_rate=closure.learning_rate,
            progress=report,
        )
    learnt = {
        "closure": "linear",
        "closure_seconds": clock.perf_counter() - before,
        "held_back": held,
        "iterations": closure.iterations,
        "loss": fitted.training[-1],
        "held_back_loss": None if fitted.validation is None else min(fitted.validation),
    }
    return eqx.tree_at(lambda f: f.system, flow, fitted.system), learnt
