"""What a hard case is, how it is run, and what is wrong with how it ended."""

from __future__ import annotations

import re
import tempfile
import time as clock
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

import jax
import numpy as np

from jaxsph import Schedule, SimulationError, Trajectory, simulate
from jaxsph.integrate import FaultCode, Model
from jaxsph.io import TrajectoryWriter, read_trajectory
from jaxsph.scenes import Scene
from jaxsph_rom.study.full_runs import silent

from .measures import Bound


class Ending(StrEnum):
    """How a case ends: its run finished, refused before it starts, or by a named fault.

    A case that ends by another error is broken; no case may.
    """

    FINISHED = "finished"
    REFUSED = "refused"
    FAULT = "fault"
    BROKEN = "broken"


@dataclass(frozen=True)
class Run:
    """What `simulate` is given, or how else a trajectory is made.

    Args:
        scene: gives the state, and what figures are scaled by.
        schedule: its steps and snapshots.
        model: the scene's full model if none is given.
        start: the scene's state if none is given.
        predict: makes the trajectory in place of `simulate`, for models without particles.
    """

    scene: Scene
    schedule: Schedule
    model: Model | None = None
    start: Any = None
    predict: Callable[[], Trajectory] | None = None


@dataclass(frozen=True)
class Case:
    """A hard case: what is run, how it may end, and the bounds that it keeps if it finishes.

    Args:
        name: family/what is hard.
        what: the same in a sentence.
        make: the run; a `ValueError` from here is a refusal.
        bounds: kept at all snapshots.
        endings: that are allowed.
        says: a regular expression that is found in the words of a refusal or a fault.
        codes: of faults that are allowed; any if none are given.
        slow: whether it takes more than some seconds.
        precision: float64 or float32, of all that is computed.
        wrong: a known fault of the library that breaks this case, if any.
    """

    name: str
    what: str
    make: Callable[[], Run]
    bounds: tuple[Bound, ...] = ()
    endings: tuple[Ending, ...] = (Ending.FINISHED,)
    says: str = ""
    codes: tuple[FaultCode, ...] = ()
    slow: bool = False
    precision: str = "float64"
    wrong: str = ""


@dataclass(frozen=True)
class Outcome:
    """How a case ended.

    Args:
        ending: how.
        says: the words of a refusal, a fault or another error.
        code: of a fault.
        recorded: snapshots in the file.
        finite: whether every number in the file is finite.
        values: of the bounds' measures, by name; none unless it finished.
        enlarged: how often the neighbour list was allocated anew.
        steps: asked for.
        seconds: it took, compilation included.
    """

    ending: Ending
    says: str = ""
    code: FaultCode | None = None
    recorded: int = 0
    finite: bool = True
    values: dict[str, float] = field(default_factory=dict)
    enlarged: int = 0
    steps: int = 0
    seconds: float = 0.0


def run_case(case: Case, progress: Callable = silent) -> Outcome:
    """Make and run a case, its snapshots recorded to a file that is then read back.

    Args:
        case: to run, in its own precision.
        progress: opens a progress bar from a label, the number of steps and those done.
    """
    start = clock.perf_counter()
    with jax.enable_x64(case.precision == "float64"):
        try:
            run = case.make()
        except ValueError as error:
            seconds = clock.perf_counter() - start
            return Outcome(Ending.REFUSED, str(error), seconds=seconds)
        except Exception as error:  # what no case may end in; the others go on
            seconds = clock.perf_counter() - start
            return Outcome(Ending.BROKEN, f"{type(error).__name__}: {error}", seconds=seconds)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "trajectory.h5")
            with progress(case.name, run.schedule.steps, 0) as report:
                fault, recorded = _recorded(run, path, report)
            stored = read_trajectory(path) if recorded else None
        finished = fault is None
        values = {b.name: b.measure(run.scene, stored) for b in case.bounds} if finished else {}
        return Outcome(
            Ending.FINISHED if finished else Ending.FAULT,
            says="" if finished else str(fault),
            code=None if finished else fault.code,
            recorded=recorded,
            finite=stored is None or all_finite(stored),
            values=values,
            enlarged=len(stored.metadata.get("enlarged_at", ())) if finished else 0,
            steps=run.schedule.steps,
            seconds=clock.perf_counter() - start,
        )


def _recorded(run: Run, path: Path, report) -> tuple[SimulationError | None, int]:
    """The fault that ended the run, if any, and the number of snapshots in its file."""
    state = run.scene.state if run.start is None else run.start
    coordinates = getattr(state, "coordinates", None)
    modes = None if coordinates is None else coordinates.shape[0]
    with TrajectoryWriter.create(path, run.scene, modes=modes) as writer:
        recorder = _Counted(writer)
        try:
            if run.predict is None:
                writer.finish(_simulated(run, state, recorder, report).metadata)
            else:
                _hand_over(run.predict(), run, recorder)
        except SimulationError as error:
            return error, recorder.count
    return None, recorder.count


class _Counted:
    """Counts the snapshots that go to a file."""

    def __init__(self, writer: TrajectoryWriter):
        self.writer, self.count = writer, 0

    def append(self, step, time, snapshot):
        self.writer.append(step, time, snapshot)
        self.count += 1


def _simulated(run: Run, state, recorder: _Counted, report) -> Trajectory:
    return simulate(
        run.scene.model() if run.model is None else run.model,
        state,
        run.schedule,
        recorder=recorder,
        progress=report,
    )


def _hand_over(trajectory: Trajectory, run: Run, recorder: _Counted) -> None:
    """The snapshots of a trajectory, one by one."""
    each = run.schedule.steps_per_snapshot
    for k, time in enumerate(trajectory.time):
        recorder.append(k * each, float(time), trajectory.snapshot(k))


def all_finite(trajectory: Trajectory) -> bool:
    """Whether every number of every snapshot is finite."""
    names = ("time", "position", "velocity", "density", "pressure", "coordinates")
    fields = (getattr(trajectory, name) for name in names)
    return all(bool(np.isfinite(a).all()) for a in fields if a is not None)


def complaints(case: Case, outcome: Outcome) -> list[str]:
    """What is wrong with how a case ended; nothing if it kept its promise."""
    found = []
    if not outcome.finite:
        found.append("a number that is not finite was recorded")
    if outcome.ending not in case.endings:
        found.append(f"it ended as {outcome.ending} ({outcome.says or 'without a word'})")
    if outcome.ending is Ending.FINISHED:
        for bound in case.bounds:
            value = outcome.values[bound.name]
            if not bound.kept(value):
                sign = ">=" if bound.at_least else "<="
                found.append(f"{bound.name}: {value:.4g}, wanted {sign} {bound.limit:g}")
        return found
    if not re.search(case.says, outcome.says):
        found.append(f"{case.says!r} is not in {outcome.says!r}")
    if outcome.ending is Ending.FAULT and case.codes and outcome.code not in case.codes:
        found.append(f"fault {outcome.code.name} ({outcome.says})")
    return found
