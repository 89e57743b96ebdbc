"""`jaxsph run SCENE --resume FILE`: on with a run, from its last snapshot or an earlier one."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from pathlib import Path

import jax
import jax.numpy as jnp

from jaxsph_command.config import NAME, read_config, write_config
from jaxsph_command.errors import Parser

from ..arrangements import Lattice
from ..content import content, differences
from ..io import Checkpoint, TrajectoryWriter, check_target, read_checkpoint
from ..particles import ParticleState
from ..scenes import SCENES, Scene
from ..scenes.record import scene_from_record
from .options import positive_float, whole_number
from .recorded import REPORT, simulate_and_report
from .scene_functions import made
from .scene_options import scene_settings

_COSTLY = ("Packed", "Stirred")  # to make, and as many particles as the lattice
_END = ("end_time", "parameters.end_time")  # what of the content tells the end
_OF_NO_RECORD = ("state.", "made_by")  # the start is in the file; steps are chosen again
_SAME_TIME = 0.01  # snapshot intervals by which a given time may be off that of a snapshot


def add_resume_options(run: Parser) -> None:
    """Add what says where a run goes on."""
    run.add_argument(
        "--resume", type=Path, metavar="FILE", help="go on with a run that was cut short"
    )
    start = run.add_mutually_exclusive_group()
    start.add_argument(
        "--from-step",
        type=whole_number,
        metavar="N",
        help="with --resume and --out: go on from the snapshot of step N, in a new file",
    )
    start.add_argument(
        "--from-time",
        type=_time,
        metavar="T",
        help="the same, from the snapshot at time T [s]",
    )


def check_resume_options(options, scene_options: list[str]) -> None:
    """A ValueError for options that do not go together.

    Args:
        options: of the command.
        scene_options: given ones that a resumed run has from its file.
    """
    branch = _branches(options)
    if options.resume is None:
        if branch:
            raise ValueError("--from-step, --from-time: name the file of the run by --resume.")
        return
    if branch and options.out is None:
        raise ValueError(
            "--from-step, --from-time: the run goes on in a new file; give its folder by --out."
        )
    given = [option for option in scene_options if option != "--t-end"]
    given += ["--out"] if options.out is not None and not branch else []
    given += ["--overwrite"] if options.overwrite else []
    if given:
        raise ValueError(
            f"{', '.join(given)}: a resumed run has its settings from its file; leave them out."
        )


def resume(options, make: Callable[..., Scene]) -> int:
    """Go on with the run in a file, in that file or, from an earlier snapshot, in a new one.

    Args:
        options: of the command.
        make: the scene's function; one of the user's own is given the settings again.
    """
    path = options.resume
    checkpoint = read_checkpoint(path)
    if options.scene in SCENES and checkpoint.scene != options.scene:
        raise ValueError(
            f"{path}: holds a run of scene {checkpoint.scene}, not of {options.scene}; "
            f"name that scene or another file."
        )
    target = path
    if _branches(options):
        checkpoint = read_checkpoint(path, _wanted_step(options, checkpoint))
        target = options.out / "trajectory.h5"
        check_target(target, overwrite=False)
        if checkpoint.step == checkpoint.schedule.steps and options.t_end is None:
            raise ValueError(f"{path}: step {checkpoint.step} is its last; name an earlier one.")
    elif options.t_end is None and _ended(path, checkpoint):
        end = checkpoint.step * checkpoint.schedule.time_step
        print(f"{path} is complete ({checkpoint.step} steps to t = {end:g} s): nothing to do.")
        return 0
    check_target(target.with_name(REPORT))
    precision = options.precision or checkpoint.parameters.get("dtype")
    with jax.enable_x64(precision != "float32"):
        if options.scene not in SCENES:
            scene = _made_again(path, checkpoint, options, make)
        else:
            scene = _restored(path, checkpoint, options.t_end)
        # room for neighbours as at the run's own start, so that sums are rounded alike
        start = scene.state if checkpoint.state is None else _arrays(read_checkpoint(path, 0).state)
        longer = None if options.t_end is None else scene
        model = scene.model(start, options.capacity_margin)
        if _branches(options):
            writer = TrajectoryWriter.branch(path, target, checkpoint.step, longer)
        else:
            writer = TrajectoryWriter.append_to(path, longer)
        _keep_config(options, path.with_name(NAME), target.with_name(NAME))
        return simulate_and_report(options, scene, model, writer, max(0, checkpoint.step))


def _keep_config(options, old: Path, new: Path) -> None:
    """What repeats the whole run: as it was first typed, with what is typed now."""
    kept = read_config(old) if old.is_file() else {}
    kept.pop("command", None)
    write_config(new, options, **(kept | options.typed))


def _time(text: str) -> float:
    """A time [s], 0 or later."""
    return 0.0 if float(text) == 0.0 else positive_float(text)


def _branches(options) -> bool:
    return options.from_step is not None or options.from_time is not None


def _wanted_step(options, checkpoint: Checkpoint) -> int:
    """The step whose snapshot is asked for."""
    if options.from_step is not None:
        return options.from_step
    schedule = checkpoint.schedule
    interval = schedule.interval
    number = round(options.from_time / interval)
    if abs(options.from_time - number * interval) > _SAME_TIME * interval:
        last = checkpoint.step * schedule.time_step
        raise ValueError(
            f"{options.resume}: holds no snapshot at t = {options.from_time:g} s; it has one every "
            f"{interval:g} s from 0 to {last:g} s."
        )
    return number * schedule.steps_per_snapshot


def _ended(path: Path, checkpoint: Checkpoint) -> bool:
    """Whether there is nothing left to run; a file killed just before its last word gets it."""
    if not checkpoint.complete and checkpoint.step == checkpoint.schedule.steps:
        with TrajectoryWriter.append_to(path) as writer:
            writer.finish()
        return True
    return checkpoint.complete


def _restored(path: Path, checkpoint: Checkpoint, end_time: float | None) -> Scene:
    """The scene of a file, its particles as they were stored, up to another end if one is given."""
    state = checkpoint.state
    rule = checkpoint.parameters.get("arrangement", {}).get("rule")
    spared = Lattice() if state is not None and rule in _COSTLY else None
    scene = scene_from_record(checkpoint.scene, checkpoint.parameters, spared)
    fits = scene.schedule == checkpoint.schedule
    if state is not None:
        fits = fits and state.position.shape == scene.state.position.shape
    if not fits:
        raise ValueError(
            f"{path}: scene {checkpoint.scene} now has other steps or particles than when the file "
            "was written; resume with the version of jaxsph that wrote it, or run it anew."
        )
    _check_unedited(path, checkpoint, scene)
    if state is not None:
        scene = _later(scene, state)
    return scene if end_time is None else _longer(scene, end_time, checkpoint)


def _made_again(path: Path, checkpoint: Checkpoint, options, make) -> Scene:
    """The scene of the user's own function, which must be the file's; its particles as stored."""
    if options.t_end is not None:
        options.t_end = _end(options.t_end, checkpoint)
    precision = options.precision or checkpoint.parameters.get("dtype", "float64")
    scene = made(make, scene_settings(options, make, precision))
    wanted = content(scene)
    if options.t_end is not None and checkpoint.content is not None:
        end = {name: wanted[name] for name in _END if name in wanted}
        checkpoint = dataclasses.replace(checkpoint, content=checkpoint.content | end)
    checkpoint.check(path, wanted)
    if checkpoint.state is None:
        return scene
    return _later(scene, checkpoint.state)


def _check_unedited(path: Path, checkpoint: Checkpoint, scene: Scene) -> None:
    """A ValueError if what was run is not what the record of its parameters makes."""
    if checkpoint.content is None:  # an old file
        return
    kept, made = (
        {name: text for name, text in found.items() if not name.startswith(_OF_NO_RECORD)}
        for found in (checkpoint.content, content(scene))
    )
    other = differences(kept, made)
    if other:
        raise ValueError(
            f"{path}: its run was of another {scene.name} than its record makes ({other}): edited "
            "in Python, or of another version; go on there, by jaxsph.run_scene(scene, path)."
        )


def _longer(scene: Scene, end_time: float, checkpoint: Checkpoint) -> Scene:
    """The scene up to a later time [s]."""
    end_time = _end(end_time, checkpoint)
    parameters = {**scene.parameters, "end_time": end_time}
    return dataclasses.replace(scene, end_time=end_time, parameters=parameters)


def _end(end_time: float, checkpoint: Checkpoint) -> float:
    """A later end [s], that of the snapshot which is meant.

    Raises:
        ValueError: if a run has come as far already, or the end lies between snapshots.
    """
    interval, done = checkpoint.schedule.interval, max(0, checkpoint.step)
    done = done * checkpoint.schedule.time_step
    if not end_time > done * (1.0 + 1e-9):
        raise ValueError(f"--t-end: the run has come to t = {done:g} s; give a later time.")
    number = round(end_time / interval)
    if abs(end_time - number * interval) > _SAME_TIME * interval:
        number = max(math.floor(end_time / interval), round(done / interval) + 1)
        raise ValueError(
            f"--t-end: {end_time:g} s lies between snapshots, which the run has every "
            f"{interval:g} s; give {number * interval:.6g} or {(number + 1) * interval:.6g}."
        )
    near = abs(end_time - number * interval) <= 1e-9 * end_time
    return end_time if near else number * interval


def _later(scene: Scene, state: ParticleState) -> Scene:
    """The scene with its particles as its own run left them, so that its exact flow still holds."""
    return dataclasses.replace(scene, state=_arrays(state), solution=scene.exact)


def _arrays(state: ParticleState) -> ParticleState:
    """On the device."""
    return jax.tree.map(jnp.asarray, state)
