"""A full model: its errors and its time."""

from __future__ import annotations

import time as clock
from pathlib import Path
from typing import Any

import jax

from jaxsph import SimulationError, Trajectory, simulate
from jaxsph.scenes import Scene
from jaxsph_rom.study import full_run

from ..measure import Clocked, progress, summary
from .scenes import command, errors, make_scene
from .settings import Case, FullSetting, named

_AGAIN = 2  # times a run is repeated where that is cheap
_CHEAP = 5.0  # s, for a run
_MARGIN_WITHOUT_SHIFTING = 3.0  # room in the neighbour list: particles then gather


def run_full(name: str, case: Case, setting: FullSetting, folder: Path) -> dict[str, Any]:
    """Errors, run time (median and spread of repeats, of whole runs and by step) and settings.

    Runs are made anew, for their time; `folder` is not used.

    Raises:
        SimulationError: if the run blows up.
    """
    del folder
    clocked, seconds, by_step = Clocked(), [], []
    with jax.enable_x64(setting.precision == "float64"):
        start = clock.perf_counter()
        scene = make_scene(name, case, setting, case.reynolds)
        made = clock.perf_counter() - start
        run = _run(scene, setting, clocked)
        compile_seconds = run.timing.compile_seconds
        repeats = _AGAIN if run.timing.run_seconds < _CHEAP else 0
        for number in range(1 + repeats):
            run = _run(scene, setting, clocked) if number else run
            seconds.append(run.timing.run_seconds)
            by_step += clocked.take()
    return {
        **errors(case, scene, run),
        "run_seconds": summary(seconds),
        "seconds_per_step": summary(by_step),
        "compile_seconds": compile_seconds,
        "start_seconds": made,
        "offline_seconds": None,
        "steps": scene.steps,
        "time_step": scene.time_step,
        "particles": run.particles,
        "command": command(name, case, setting, scene.time_step),
    }


def _run(scene: Scene, setting: FullSetting, clocked: Clocked) -> Trajectory:
    with clocked.progress(named(setting), scene.steps, 0) as report:
        return simulate(
            scene.model(margin=None if setting.shifting else _MARGIN_WITHOUT_SHIFTING),
            scene.state,
            scene.schedule,
            progress=report,
        )


def training_runs(
    name: str, case: Case, setting: FullSetting, folder: Path
) -> tuple[dict[float, Scene], dict[float, Trajectory], float]:
    """Scenes and full runs by Reynolds number, those trained on, and the seconds they took.

    They are kept in the folder.

    Raises:
        ValueError: if one of them blows up, as nothing can be trained then.
    """
    scenes = {re: make_scene(name, case, setting, re) for re in case.trained_on}
    try:
        runs = {re: full_run(folder, scene, progress) for re, scene in scenes.items()}
    except SimulationError as error:
        raise ValueError(f"training run: {error}") from None
    seconds = sum(
        run.timing.seconds(scenes[re].steps)
        for re, run in runs.items()
    )
    return scenes, runs, seconds
