"""Reduced models: on moving particles, by tensors on reference points, at samples of these."""

from __future__ import annotations

import time as clock
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from jaxsph import SimulationError, Trajectory
from jaxsph.integrate import integrate
from jaxsph.scenes import Scene
from jaxsph_rom import AdjointPetrovGalerkin, Experiment, Galerkin, OnParticles, Study
from jaxsph_rom.cli import PRODUCTS
from jaxsph_rom.cli.run import ADVECTIONS, INTERPOLATIONS, MAPS, MEMORIES
from jaxsph_rom.points import (
    QDEIM,
    Coefficients,
    Compressible,
    EulerianRates,
    LinearClosure,
    NonNegativeWeights,
    PointsModel,
    ReducedFlow,
    SampledRates,
    Solenoidal,
    TrainedModel,
    VisitedStates,
    mapped_run,
    rate_basis,
    train_each,
)
from jaxsph_rom.points.dynamics.fixed_points import on_points
from jaxsph_rom.points.training.linear_closure import held_back

from ..measure import Clocked, progress, repeated, summary
from .full import training_runs
from .scenes import command, errors, make_scene
from .settings import MOVING, TENSOR, Case, ReducedSetting

SAMPLINGS = {"q-deim": QDEIM, "non-negative": NonNegativeWeights}
_REPEATS = 9  # of runs of milliseconds
_SAMPLED_REPEATS = 3  # of runs of seconds
_STATES = 20  # of each training run, whose rates choose samples


def run_reduced(name: str, case: Case, setting: ReducedSetting, folder: Path) -> dict[str, Any]:
    """Errors, run time and what training cost: full runs, and what was made of them.

    Training runs, and reduced runs on moving particles, are kept in the folder.

    Raises:
        SimulationError: if the reduced run blows up; on moving particles its fault is returned.
        ValueError: if a training run does.
    """
    training = setting.training
    folder = folder / name / f"{training.resolution}-{training.h_over_dx:g}-{training.step:g}"
    scenes, runs, full_seconds = training_runs(name, case, training, folder / "full")
    scene = make_scene(name, case, training, case.reynolds)
    if setting.family == MOVING:
        run, row = _moving(case, setting, scene, scenes, folder)
    elif setting.family == TENSOR:
        run, row = _tensor(case, setting, scene, scenes, runs)
    else:
        run, row = sampled(case, setting, scene, scenes, runs)
    if run is None:
        return row
    return {
        **errors(case, scene, run),
        **row,
        "training_run_seconds": full_seconds,
        "offline_seconds": full_seconds + row["training_seconds"],
        "steps": scene.steps,
        "time_step": scene.time_step,
        "particles": scene.state.position.shape[0],
        "command": command(name, case, setting, scene.time_step),
    }


class _FromTheFirstStep(Clocked):
    """Progress bars that also keep when the reduced run's opened: all before it is offline."""

    opened: float | None = None

    @contextmanager
    def watched(self, label, total, done):
        if label.startswith("reduced"):
            self.opened = clock.perf_counter()
        with self.progress(label, total, done) as report:
            yield report


def _moving(
    case: Case, setting: ReducedSetting, scene: Scene, scenes: dict[float, Scene], folder: Path
) -> tuple[Trajectory | None, dict[str, Any]]:
    """By the library's own study, which compares with a full run; that one is no part of the cost.

    There is no trajectory of a run that blew up, only its fault.
    """
    bars = _FromTheFirstStep()
    study = Study(
        lambda reynolds: scenes.get(reynolds, scene),
        folder,
        OnParticles(
            (_projection(setting, scene),),
            PRODUCTS[setting.product](),
            ADVECTIONS[setting.advection](),
            MAPS[setting.map],
            INTERPOLATIONS[setting.interpolation],
            setting.spline_order,
        ),
        progress=bars.watched,
    )
    for reynolds in (*case.trained_on, case.reynolds):
        study.runs.full(reynolds)
    start = clock.perf_counter()
    (outcome,) = study.run(Experiment(case.trained_on, (case.reynolds,), (setting.modes,)))
    if outcome.case.fault is not None:
        return None, {"fault": outcome.case.fault}
    until = clock.perf_counter() if bars.opened is None else bars.opened
    return outcome.trajectory, {
        "run_seconds": summary([outcome.case.rom_seconds]),
        "seconds_per_step": summary(bars.take()),
        "compile_seconds": outcome.case.rom_compile_seconds,
        "training_seconds": until - start,
    }


def _projection(setting: ReducedSetting, scene: Scene):
    if setting.projection == "galerkin":
        return Galerkin()
    if isinstance(setting.tau, str):
        return MEMORIES[setting.tau]
    return AdjointPetrovGalerkin(jnp.asarray(setting.tau, scene.state.density.dtype))


def _trained(
    case: Case, setting: ReducedSetting, scenes: dict[float, Scene], runs: dict[float, Trajectory]
) -> TrainedModel:
    formulation = Solenoidal()
    if setting.formulation == "compressible":
        formulation = Compressible(PRODUCTS[setting.product]())
    (name,) = {scene.name for scene in scenes.values()}
    parameters = [{"reynolds": reynolds} for reynolds in scenes]

    def make(reynolds):
        return make_scene(name, case, setting.training, reynolds)

    closure = LinearClosure(held_back(parameters)) if setting.closure == "linear" else None
    (trained,) = train_each(
        make, parameters, (setting.modes,), runs=list(runs.values()),
        formulation=formulation, closure=closure, progress=progress,
    )  # fmt: skip
    return trained


def _viscosity(scene: Scene) -> float:
    (viscosity,) = Coefficients.named(on_points(scene), "viscosity").values(on_points(scene))
    return float(viscosity)


def _start(flow: ReducedFlow, scene: Scene):
    """Coordinates (1, M) of the full model's own start."""
    state = scene.state
    first = Trajectory(
        np.zeros(1),
        *(np.asarray(a)[None] for a in (state.position, state.velocity, state.density)),
        np.asarray(scene.fluid.pressure(state.density))[None],
    )
    return flow.project(mapped_run(flow.reference, first, scene.fluid))


def _tensor(case: Case, setting, scene: Scene, scenes, runs) -> tuple[Trajectory, dict[str, Any]]:
    begin = clock.perf_counter()
    trained = _trained(case, setting, scenes, runs)
    training = clock.perf_counter() - begin
    flow, start = trained.flow, _start(trained.flow, scene)
    steps = _viscosity(scene), scene.schedule
    found, first, seconds = repeated(lambda: flow.predict(start[0], *steps), _REPEATS)
    return _fields(flow, scene, start, found), {
        "run_seconds": summary(seconds),
        "compile_seconds": first - float(np.median(seconds)),
        "training_seconds": training,
    }


def sampled(case: Case, setting, scene: Scene, scenes, runs) -> tuple[Trajectory, dict[str, Any]]:
    """Rates at samples, chosen by the rates along the training runs.

    Raises:
        SimulationError: if the run blows up.
    """
    begin = clock.perf_counter()
    flow = _trained(case, setting, scenes, runs).flow
    rates = EulerianRates.of_scene(scene, flow.reference.points)
    visited = []
    for reynolds, run in runs.items():
        some = np.unique(np.linspace(0, len(run.time) - 1, _STATES).round().astype(int))
        coordinates = np.asarray(flow.project(mapped_run(flow.reference, run, scene.fluid)))
        viscosity = _viscosity(scenes[reynolds])
        visited.append(VisitedStates(viscosity, run.time[some], coordinates[some]))
    sampling = SAMPLINGS[setting.hyper](setting.samples)
    samples = sampling.choose(flow.basis, rate_basis(rates, flow.basis, visited))
    model = PointsModel(SampledRates.of_samples(rates, flow.basis, samples), _viscosity(scene))
    training = clock.perf_counter() - begin
    start = _start(flow, scene)
    found, first, seconds = repeated(lambda: _integrated(model, start[0], scene), _SAMPLED_REPEATS)
    _, fault, coordinates, _ = found
    if int(fault.code) != 0:
        raise SimulationError(fault, scene.time_step)
    return _fields(flow, scene, start, coordinates), {
        "run_seconds": summary(seconds),
        "compile_seconds": first - float(np.median(seconds)),
        "training_seconds": training,
        "points_read": len(model.dynamics.modes),
    }


def _integrated(model: PointsModel, coordinates, scene: Scene):
    step = jnp.asarray(scene.time_step, coordinates.dtype)
    return _run(model, coordinates, step, scene.steps_per_snapshot, scene.schedule.intervals)


@eqx.filter_jit
def _run(model, coordinates, step, each: int, intervals: int):
    return integrate(model, coordinates, jnp.zeros((), jnp.int32), step, each, intervals)


def _fields(flow: ReducedFlow, scene: Scene, start, found) -> Trajectory:
    """On the reference points, at the times of snapshots."""
    coordinates = jnp.concatenate([start, jax.block_until_ready(found)])
    return flow.fields(coordinates, scene.schedule.interval * np.arange(len(coordinates)))
