"""A study: full runs, a basis from them, reduced runs, and how the two compare."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from jaxsph import SimulationError, Trajectory
from jaxsph.content import digest
from jaxsph.io import read_trajectory
from jaxsph.kept_run import kept_run
from jaxsph.metrics import centre_line, probe, relative_discrepancy
from jaxsph.scenes import Scene

from ..basis import Basis, pod
from ..model import ReducedModel, ReducedState
from ..projection import AdjointPetrovGalerkin, Galerkin, MemoryLength, Projection
from ..reference import ReferenceSpace, lagrangian_snapshots
from ..report import Case
from .method import Method
from .recorded_run import Progress, full_run, with_record

_UNIFORM = 1e-6  # of the largest spread over the probes that a field has at any time


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
    """What a reduced model is made of, for the report.

    Args:
        model: what kind it is.
        trained_on: Reynolds numbers of its training runs.
        basis: of the model.
        reference: the points of its modes, and the map to them.
    """

    model: str
    trained_on: tuple[float, ...]
    basis: Basis
    reference: ReferenceSpace


@dataclass(frozen=True)
class Outcome:
    """A reduced run beside its full one.

    Args:
        case: errors and times.
        time, velocity_percent, pressure_percent: discrepancy on the probes over time (S,).
        trajectory: of the reduced model, as far as it came.
        profile: velocity norm and pressure on the probes over time, each (S, P).
        made_of: the model's basis; None if it is that of the study.
    """

    case: Case
    time: np.ndarray
    velocity_percent: np.ndarray
    pressure_percent: np.ndarray
    trajectory: Trajectory
    profile: tuple[np.ndarray, np.ndarray]
    made_of: ModelBasis | None = None


class Study:
    """Full runs are made once, whatever the number of experiments; all runs are kept on disk.

    Args:
        make: a scene from a Reynolds number.
        folder: where trajectories are kept; a study that was cut short goes on from there.
        projections: to compare. A `MemoryLength` among them stands for the adjoint Petrov-Galerkin
            projection with the memory length that it finds for each run.
        method: how the reduced models are made; `FAITHFUL` is the paper's.
        progress: opens a progress bar for each run.
        probes: where runs are compared, (P, n) [m] from a scene; the centre line if none is given.
        judged_from: time [s] from which on peaks and medians are taken.
    """

    def __init__(
        self,
        make: Callable[[float], Scene],
        folder: Path,
        projections: tuple[Projection | MemoryLength, ...] | None = None,
        method: Method = Method(),  # noqa: B008
        progress: Progress | None = None,
        probes: Callable[[Scene], np.ndarray] | None = None,
        judged_from: float = 0.0,
    ):
        self.scene = cache(make)
        self.folder = Path(folder)
        self.projections = (Galerkin(),) if projections is None else projections
        self.method = method
        self.progress = silent if progress is None else progress
        self._probes = _centre_line if probes is None else probes
        self.judged_from = judged_from
        self.full = cache(self._full)
        self.profile = cache(self._profile)
        self.snapshots = cache(self._snapshots)

    def check(self, experiment: Experiment) -> None:
        """A ValueError for more modes than snapshots, or an interpolation, advection or map
        that does not fit."""
        available = 0
        for reynolds in dict.fromkeys(experiment.trained_on + experiment.reynolds):
            scene = self.scene(reynolds)
            if reynolds in experiment.trained_on:
                available += scene.schedule.intervals + 1
        for modes in experiment.modes:
            if not 1 <= modes <= available:
                raise ValueError(
                    f"modes: {modes} asked for, but the training runs give {available} snapshots; "
                    "ask for fewer modes, a longer run or more training runs."
                )

        scene = self.scene(experiment.trained_on[0])
        points = np.asarray(scene.state.position)
        self.method.interpolation.check(points, scene.space, self.method.spline_order)
        self.method.advection.eulerian(scene.effects)
        self.reference(experiment)

    def _full(self, reynolds: float) -> Trajectory:
        return full_run(self.folder / "full", self.scene(reynolds), self.progress)

    def probes(self, reynolds: float) -> np.ndarray:
        """Where runs are compared (P, n) [m]."""
        return self._probes(self.scene(reynolds))

    def _profile(self, reynolds: float) -> tuple[np.ndarray, np.ndarray]:
        """Velocity norm and pressure of the full run on the probes over time."""
        return probe(self.full(reynolds), self.probes(reynolds), self.scene(reynolds).space)

    def reference(self, experiment: Experiment) -> ReferenceSpace:
        """The reference space: the initial configuration of the first training run."""
        scene = self.scene(experiment.trained_on[0])
        return ReferenceSpace(scene.state.position, scene.space, self.method.rule)

    def _snapshots(self, reynolds: float, first: float) -> np.ndarray:
        """Mapped snapshots of a run on the reference space of the run at Re `first`."""
        scene = self.scene(first)
        reference = ReferenceSpace(scene.state.position, scene.space, self.method.rule)
        return reference.snapshots(self.full(reynolds))

    def basis(self, experiment: Experiment, modes: int | None = None) -> Basis:
        """POD basis of the training runs on the reference space."""
        first = experiment.trained_on[0]
        matrices = [self.snapshots(reynolds, first) for reynolds in experiment.trained_on]
        fluid = self.scene(first).fluid
        return self._pod(matrices, fluid, modes)

    def lagrangian_basis(self, experiment: Experiment, modes: int | None = None) -> Basis:
        """POD basis of the training runs in Lagrangian space, for comparison."""
        runs = [lagrangian_snapshots(self.full(reynolds)) for reynolds in experiment.trained_on]
        fluid = self.scene(experiment.trained_on[0]).fluid
        return self._pod(runs, fluid, modes)

    def _pod(self, matrices, fluid, modes: int | None) -> Basis:
        together, method = np.concatenate(matrices, axis=-1), self.method
        return pod(together, method.product, fluid, modes, method.centring)

    def run(self, experiment: Experiment) -> Iterator[Outcome]:
        """All reduced runs of an experiment, each compared with the full run."""
        self.check(experiment)
        for reynolds in dict.fromkeys(experiment.trained_on + experiment.reynolds):
            self.full(reynolds)
        basis = self.basis(experiment, max(experiment.modes))
        points = np.asarray(self.reference(experiment).points)
        values = basis.functions.reshape(len(points), -1)
        numbers = np.arange(values.shape[1]).reshape(basis.modes.shape[1], -1)
        space = self.scene(experiment.trained_on[0]).space
        fit, order = self.method.interpolation.fit, self.method.spline_order
        interpolation = fit(points, values, space, order)
        for modes in experiment.modes:
            part = basis.truncated(modes)
            kept = np.delete(numbers, np.s_[modes : basis.size], axis=1).reshape(-1)
            for reynolds in experiment.reynolds:
                for projection in self.projections:
                    yield self._reduced(
                        experiment, reynolds, part, interpolation.select(kept), projection
                    )

    def _reduced(self, experiment, reynolds, basis, interpolation, projection) -> Outcome:
        scene = self.scene(reynolds)
        memory = None
        if isinstance(projection, MemoryLength):
            memory = projection
            projection = self._petrov_galerkin(memory, scene, basis, interpolation)
        tau = float(projection.tau) if isinstance(projection, AdjointPetrovGalerkin) else None
        trained = "-".join(f"{r:g}" for r in experiment.trained_on)
        name = projection.name if tau is None else f"{projection.name}-{tau:g}"
        name = name if memory is None else f"{projection.name}-{memory.label}"
        recorded = with_record(
            scene,
            reduced={
                "trained_on": list(experiment.trained_on),
                "modes": basis.size,
                "projection": projection.name,
                "tau": tau,
                **self.method.record(),
            },
        )

        def restore(trajectory):
            return ReducedState(
                jnp.asarray(trajectory.coordinates[-1]), jnp.asarray(trajectory.position[-1])
            )

        path = self.folder / "reduced" / f"{self.method.label}-{trained}" / f"re-{reynolds:g}"
        path = path / f"m-{basis.size}-{name}.h5"
        label = f"reduced model, Re {reynolds:g}, M = {basis.size}, {name}"
        fault = None
        try:
            run = kept_run(
                path,
                recorded,
                lambda: ReducedModel.of_scene(
                    scene, basis, interpolation, projection, self.method.advection
                ),
                lambda model: eqx.filter_jit(model.project)(scene.state),
                restore,
                lambda done: self.progress(label, scene.steps, done),
                {
                    "training": [digest(self.scene(number)) for number in experiment.trained_on],
                    "method": self.method,
                    "projection": projection,
                },
            )
        except SimulationError as error:
            fault, run = error, read_trajectory(path)
        memory = None if memory is None else memory.label
        return self._compare(experiment, reynolds, basis, projection, tau, memory, run, fault)

    def _petrov_galerkin(self, memory, scene, basis, interpolation) -> AdjointPetrovGalerkin:
        advection = self.method.advection
        model = ReducedModel.of_scene(scene, basis, interpolation, Galerkin(), advection)
        tau = memory(model, eqx.filter_jit(model.project)(scene.state))
        # rounded, so that a run that is taken up again finds the very number that it recorded
        return AdjointPetrovGalerkin(jnp.asarray(float(f"{tau:.4g}"), scene.state.density.dtype))

    def _compare(self, experiment, reynolds, basis, projection, tau, memory, run, fault) -> Outcome:
        scene = self.scene(reynolds)
        rest = {
            "modes": basis.size,
            "projection": projection.name,
            "tau": tau,
            "memory": memory,
            "hyper": "none",
            "trained_on": tuple(experiment.trained_on),
            "rom_seconds": _whole_run(run, scene.steps) if fault is None else None,
            "rom_compile_seconds": run.metadata.get("compile_seconds"),
        }
        profile = probe(run, self.probes(reynolds), scene.space)
        return self.judged(reynolds, run, profile, fault, rest)

    def judged(
        self,
        reynolds: float,
        run: Trajectory,
        profile: tuple[np.ndarray, np.ndarray],
        fault: SimulationError | None,
        rest: dict[str, Any],
        made_of: ModelBasis | None = None,
    ) -> Outcome:
        """A reduced run beside its full one.

        Args:
            reynolds: of the run.
            run: of the reduced model, as far as it came.
            profile: its velocity norm and pressure on the probes (S, P).
            fault: that ended it, if any.
            rest: values of the `Case` that only its maker knows.
            made_of: the model's basis; that of the study if none is given.
        """
        scene, full = self.scene(reynolds), self.full(reynolds)
        truth = tuple(a[: len(run.time)] for a in self.profile(reynolds))
        percent = [_percent(a, b) for a, b in zip(truth, profile, strict=True)]
        judged = run.time >= min(self.judged_from, run.time[-1])
        case = Case(
            scene=scene.name,
            reynolds=reynolds,
            inner_product=self.method.product_name.lower(),
            velocity_peak_percent=float(percent[0][judged].max()),
            velocity_median_percent=float(np.median(percent[0][judged])),
            pressure_peak_percent=float(percent[1][judged].max()),
            pressure_median_percent=float(np.median(percent[1][judged])),
            stable=fault is None,
            fom_seconds=_whole_run(full, scene.steps),
            fom_steps=scene.steps,
            rom_steps=scene.steps if fault is None else fault.step,
            fom_compile_seconds=full.metadata["compile_seconds"],
            compression_factor=full.particles * (2 * scene.space.box.dim + 1) / rest["modes"],
            fault=None if fault is None else str(fault),
            fault_time=None if fault is None else fault.step * scene.time_step,
            **rest,
        )
        return Outcome(case, run.time, percent[0], percent[1], run, profile, made_of)


def _percent(reference: np.ndarray, values: np.ndarray) -> np.ndarray:
    """The relative discrepancy; where the reference is all but uniform, that to its largest spread
    at any time."""
    spread = np.ptp(reference, axis=1)
    uniform = spread <= _UNIFORM * spread.max()
    apart = np.abs(reference - values).mean(axis=1)
    largest = 100.0 * apart / spread.max() if spread.max() > 0.0 else 0.0 * apart
    return np.where(uniform, largest, relative_discrepancy(reference, values))


def _centre_line(scene: Scene) -> np.ndarray:
    return centre_line(scene.space)


def _whole_run(trajectory: Trajectory, steps: int) -> float:
    """Run time [s], extrapolated from the last part of a run that was taken up again."""
    metadata = trajectory.metadata
    return metadata["run_seconds"] * steps / metadata["steps"]


@contextmanager
def silent(label: str, total: int, done: int):
    """A progress bar that shows nothing."""
    yield lambda steps: None
