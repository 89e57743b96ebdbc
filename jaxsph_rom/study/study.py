"""A study: full runs, reduced runs by several methods, and how these compare."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from jaxsph import Trajectory
from jaxsph.metrics import relative_discrepancy
from jaxsph.scenes import Scene

from ..points import TrainedModel
from ..pressure_noise import is_noise
from ..report import Case
from .full_runs import FullRuns
from .method import Experiment, Method, ModelBasis, ReducedRun
from .on_particles import OnParticles
from .recorded_run import Progress

_UNIFORM = 1e-6  # of the largest spread over the probes that a field has at any time


@dataclass(frozen=True)
class Outcome:
    """A reduced run beside its full one.

    Args:
        case: errors and times.
        time, velocity_percent, pressure_percent: discrepancy on the probes over time (S,); no
            number of a pressure that is uniform but for noise.
        trajectory: of the reduced model, as far as it came.
        profile: velocity norm and pressure on the probes over time, each (S, P).
        made_of: tells what the model is made of.
        model: that runs at any parameters, where the method makes one.
        floor: discrepancy of velocity and pressure of the full run's own projection, where that is
            known: what no model in this basis is below for long.
    """

    case: Case
    time: np.ndarray
    velocity_percent: np.ndarray
    pressure_percent: np.ndarray
    trajectory: Trajectory
    profile: tuple[np.ndarray, np.ndarray]
    made_of: Callable[[], ModelBasis]
    model: TrainedModel | None = None
    floor: tuple[np.ndarray, np.ndarray] | None = None


class Study:
    """Full runs are made once, whatever the number of methods and experiments; they are kept on
    disk, and so is every reduced run that takes its time.

    Args:
        make: a scene from a Reynolds number.
        folder: where trajectories are kept; a study that was cut short goes on from there.
        methods: to compare, `OnParticles(...)` and `OnPoints(...)`; models on moving particles if
            none are given.
        progress: opens a progress bar for each run.
        probes: where runs are compared, (P, n) [m] from a scene; the centre line if none is given.
        judged_from: time [s] from which on peaks and medians are taken.
    """

    def __init__(
        self,
        make: Callable[[float], Scene],
        folder: Path | str,
        *methods: Method,
        progress: Progress | None = None,
        probes: Callable[[Scene], np.ndarray] | None = None,
        judged_from: float = 0.0,
    ):
        self.runs = FullRuns(make, Path(folder), progress, probes)
        self.methods = methods or (OnParticles(),)
        self.judged_from = judged_from

    def check(self, *experiments: Experiment) -> None:
        """A ValueError for more modes than snapshots, or what a method cannot do."""
        for experiment in experiments:
            available = 0
            for reynolds in dict.fromkeys(experiment.trained_on + experiment.reynolds):
                scene = self.runs.scene(reynolds)
                if reynolds in experiment.trained_on:
                    available += scene.schedule.intervals + 1
            for modes in experiment.modes:
                if not 1 <= modes <= available:
                    raise ValueError(
                        f"modes: {modes} asked for, but the training runs give {available} "
                        "snapshots; ask for fewer modes, a longer run or more training runs."
                    )
            for method in self.methods:
                method.check(self.runs, experiment)

    def run(self, *experiments: Experiment) -> Iterator[Outcome]:
        """All reduced runs of experiments, method by method, each compared with the full run."""
        self.check(*experiments)
        for method in self.methods:
            for experiment in experiments:
                for run in method.run(self.runs, experiment):
                    yield self._judged(run, method)

    def _judged(self, run: ReducedRun, method: Method) -> Outcome:
        """A reduced run beside its full one."""
        scene, full = self.runs.scene(run.reynolds), self.runs.full(run.reynolds)
        time = run.trajectory.time
        truth = tuple(a[: len(time)] for a in self.runs.profile(run.reynolds))
        percent = [_percent(a, b) for a, b in zip(truth, run.profile, strict=True)]
        floor = None
        if run.projected is not None:
            held = (values[: len(time)] for values in run.projected)
            floor = tuple(_percent(a, b) for a, b in zip(truth, held, strict=True))
        judged, fault = time >= min(self.judged_from, time[-1]), run.fault
        apart = np.abs(truth[1] - run.profile[1]).mean(axis=1)[judged]
        uniform = is_noise(truth[1], scene.fluid)
        if uniform:
            percent[1] = np.full(len(time), np.nan)
            floor = None if floor is None else (floor[0], percent[1])
        case = Case(
            scene=scene.name,
            reynolds=run.reynolds,
            inner_product=method.product_name.lower(),
            velocity_peak_percent=float(percent[0][judged].max()),
            velocity_median_percent=float(np.median(percent[0][judged])),
            pressure_peak_percent=None if uniform else float(percent[1][judged].max()),
            pressure_median_percent=None if uniform else float(np.median(percent[1][judged])),
            pressure_peak_pascal=float(apart.max()),
            pressure_median_pascal=float(np.median(apart)),
            stable=fault is None and "doubt" not in run.told,
            fom_seconds=self.runs.seconds(run.reynolds),
            training_seconds=sum(map(self.runs.seconds, run.told["trained_on"])),
            fom_steps=scene.steps,
            rom_steps=scene.steps if fault is None else fault.step,
            fom_compile_seconds=full.timing.compile_seconds,
            compression_factor=full.particles * (2 * scene.space.box.dim + 1) / run.told["modes"],
            fault=None if fault is None else str(fault),
            fault_time=None if fault is None else fault.step * scene.time_step,
            **run.told,
        )
        return Outcome(
            case, time, *percent, run.trajectory, run.profile, run.made_of, run.model, floor
        )


def _percent(reference: np.ndarray, values: np.ndarray) -> np.ndarray:
    """The relative discrepancy; where the reference is all but uniform, that to its largest spread
    at any time."""
    spread = np.ptp(reference, axis=1)
    uniform = spread <= _UNIFORM * spread.max()
    apart = np.abs(reference - values).mean(axis=1)
    largest = 100.0 * apart / spread.max() if spread.max() > 0.0 else 0.0 * apart
    return np.where(uniform, largest, relative_discrepancy(reference, values))
