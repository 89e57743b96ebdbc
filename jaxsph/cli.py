"""The command line: `jaxsph scenes` and `jaxsph run SCENE`."""

from __future__ import annotations

import argparse
import dataclasses
import inspect
import json
import math
import sys
from pathlib import Path
from typing import Any, NoReturn

import jax
import jax.numpy as jnp
import numpy as np
from tqdm import tqdm

from . import __version__
from .arrangements import Arrangement, JitteredLattice, Lattice, Packed, Stirred
from .environment import environment
from .integrate import AutomaticSteps, FixedSteps, SimulationError
from .io import (
    Checkpoint,
    TrajectoryFileError,
    TrajectoryWriter,
    check_target,
    read_checkpoint,
)
from .metrics import kinetic_energy
from .scenes import SCENES, Scene
from .scenes import taylor_green_solution as taylor_green_exact
from .scenes.lid_driven_cavity import LIDS
from .scenes.record import scene_from_record
from .simulate import simulate
from .trajectory import Trajectory

STEPPING = {"fixed": FixedSteps(), "automatic": AutomaticSteps()}
ARRANGEMENTS = {
    "packed": Packed,
    "lattice": lambda seed: Lattice(),
    "jittered": JitteredLattice,
    "stirred": Stirred,
}
_COSTLY = ("Packed", "Stirred")  # to make, and as many particles as the lattice
SCALES = ("small", "half", "paper")
# options that say what is run, and the scene's name for each; a resumed run has them from its file
_SCENE_OPTIONS = {
    "resolution": "resolution",
    "reynolds": "reynolds",
    "t_end": "end_time",
    "scale": "scale",
    "h_over_dx": "h_over_dx",
    "time_step": "time_step",
    "arrangement": "arrangement",
    "seed": "arrangement",
    "lid": "lid",
    "precision": "dtype",
}


_STEPS_HELP = (
    "fixed: dt throughout; automatic: as long as sound, viscosity, tension and forces allow "
    "(default: fixed; give it again with --resume)"
)
_MARGIN_HELP = "room in the neighbour list over its need at the start (default: the scene's)"


class Parser(argparse.ArgumentParser):
    """An argument parser whose errors are `ValueError`s, for `report_errors` to print."""

    def error(self, message: str) -> NoReturn:
        raise ValueError(f"{message} (see {self.prog} --help).")


def positive_float(text: str) -> float:
    """A finite number above zero."""
    value = float(text)
    if not 0.0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"must be positive and finite, got {text}")
    return value


def positive_int(text: str) -> int:
    """A whole number above zero."""
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"must be at least 1, got {text}")
    return value


def seed(text: str) -> int:
    """A seed of random numbers."""
    value = int(text)
    if not 0 <= value < 2**32:
        raise argparse.ArgumentTypeError(f"must be from 0 to 2^32 - 1, got {text}")
    return value


def margin(text: str) -> float:
    """A factor on allocated capacities."""
    value = float(text)
    if not 1.0 <= value < math.inf:
        raise argparse.ArgumentTypeError(f"must be at least 1, got {text}")
    return value


def report_errors(program: str, command, *arguments) -> int:
    """Run a command; what is wrong with its input becomes one line on stderr and code 2.

    A disk that fails in mid-run gives code 1.
    """
    try:
        return command(*arguments)
    except MemoryError:
        return fail(program, "not enough memory; lower the resolution.", 2)
    except ValueError as error:
        return fail(program, str(error), 2)
    except OSError as error:
        return fail(program, f"{error}; choose another place.", 1)


def fail(program: str, message: str, code: int) -> int:
    """Print an error as one line on stderr; the exit code is handed back."""
    print(f"{program}: error: {' '.join(message.split())}", file=sys.stderr)
    return code


def main(argv: list[str] | None = None) -> int:
    """The `jaxsph` command. Exit code 0: good, 1: a fault in mid-run, 2: bad input."""
    return report_errors("jaxsph", _command, argv)


def _command(argv) -> int:
    options = _parser().parse_args(argv)
    return options.command(options)


def _parser() -> Parser:
    parser = Parser("jaxsph", description="Differentiable smoothed-particle hydrodynamics.")
    parser.add_argument("--version", action="version", version=f"jaxsph {__version__}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    scenes = commands.add_parser("scenes", help="list the scenes, their effects and sizes")
    scenes.set_defaults(command=_list_scenes)
    scenes.add_argument(
        "--scale", choices=SCALES, action="append", help="sizes to list (default: small)"
    )
    run = commands.add_parser("run", help="run a full model", description="Run a full model.")
    run.set_defaults(command=_run)
    add = run.add_argument
    add("scene", metavar="SCENE", help=f"one of {', '.join(SCENES)}")
    add("--resolution", type=positive_int, metavar="N", help="particles per longest side")
    add("--reynolds", type=positive_float, metavar="RE", help="Reynolds number")
    add("--t-end", type=positive_float, metavar="T", help="end time [s]")
    add("--scale", choices=SCALES, help="size of the run (default: small)")
    add("--h-over-dx", type=positive_float, metavar="X", help="smoothing length over spacing")
    add("--time-step", type=positive_float, metavar="DT", help="time step [s]")
    add(
        "--arrangement",
        choices=tuple(ARRANGEMENTS),
        help="how particles start (default: the scene's)",
    )
    add("--seed", type=seed, metavar="N", help="of the arrangement (default: 0)")
    add("--lid", choices=tuple(LIDS), help="profile of the lid (default: regularised)")
    add("--precision", choices=("float32", "float64"), help="default: float64")
    add("--steps", choices=tuple(STEPPING), default="fixed", help=_STEPS_HELP)
    add("--capacity-margin", type=margin, metavar="X", help=_MARGIN_HELP)
    add("--out", type=Path, metavar="DIR", help="folder for trajectory.h5 (default: out/SCENE)")
    add("--json", type=Path, metavar="FILE", help="write the results to FILE as well")
    add("--overwrite", action="store_true", help="replace a trajectory.h5 that is there")
    add("--resume", type=Path, metavar="FILE", help="go on with a run that was cut short")
    return parser


def _list_scenes(options) -> int:
    for name, make in SCENES.items():
        print(f"{name}: {(inspect.getdoc(make) or '').partition(chr(10))[0]}")
        for number, scale in enumerate(options.scale or SCALES[:1]):
            scene = make(scale=scale, **_cheap(make))
            if not all(scene.space.box.periodic):  # only periodic scenes pack their particles
                scene = make(scale=scale)
            if number == 0:
                print(f"  effects: {', '.join(effect.name for effect in scene.effects)}")
            print(
                f"  {scale:6} {scene.state.position.shape[0]:>7} particles, "
                f"dx = {scene.space.spacing:.4g} m, "
                f"h/dx = {scene.space.smoothing_length / scene.space.spacing:.3g}, "
                f"dt = {scene.time_step:.4g} s, {scene.steps} steps to t = {scene.end_time:g} s"
            )
    return 0


def _cheap(make) -> dict[str, Arrangement]:
    """Options that spare the packing where only a scene's settings matter."""
    return {"arrangement": Lattice()} if "arrangement" in _takes(make) else {}


def _takes(make):
    return inspect.signature(make).parameters


def _run(options) -> int:
    if options.scene not in SCENES:
        raise ValueError(
            f"scene: {options.scene!r} is not known; choose one of {', '.join(SCENES)}."
        )
    if options.json is not None:
        check_target(options.json)
    if options.resume is not None:
        return _resume(options)
    path = (Path("out", options.scene) if options.out is None else options.out) / "trajectory.h5"
    check_target(path, options.overwrite)
    precision = options.precision or "float64"
    with jax.enable_x64(precision == "float64"):
        make = SCENES[options.scene]
        settings = _settings(options, make, precision)
        make(**{**settings, **_cheap(make)})  # meets all bad input before the packing
        scene = make(**settings)
        model = scene.model(margin=options.capacity_margin)
        writer = TrajectoryWriter.create(path, scene, overwrite=options.overwrite)
        return _simulate(options, scene, model, writer, 0)


def _settings(options, make, precision: str) -> dict[str, Any]:
    """What is given on the command line, in the scene's own words."""
    settings = {}
    for option, name in _SCENE_OPTIONS.items():
        value = getattr(options, option)
        if value is None:
            continue
        if name not in _takes(make):
            raise ValueError(f"{_flag(option)}: scene {options.scene} has no such setting.")
        settings[name] = value
    if "arrangement" in settings:
        rule = ARRANGEMENTS[options.arrangement or "packed"]
        settings["arrangement"] = rule(seed=options.seed or 0)
    return {**settings, "dtype": precision} if "dtype" in _takes(make) else settings


def _flag(option: str) -> str:
    return "--" + option.replace("_", "-")


def _resume(options) -> int:
    given = [name for name in (*_SCENE_OPTIONS, "out") if getattr(options, name) is not None]
    if options.overwrite:
        given.append("overwrite")
    if given:
        raise ValueError(
            f"{', '.join(map(_flag, given))}: a resumed run has its settings from its file; "
            "leave them out."
        )
    path, checkpoint = options.resume, read_checkpoint(options.resume)
    if checkpoint.scene != options.scene:
        raise ValueError(
            f"{path}: holds a run of scene {checkpoint.scene}, not of {options.scene}; "
            f"name that scene or another file."
        )
    if not checkpoint.complete and checkpoint.step == checkpoint.steps:
        with TrajectoryWriter.append_to(path) as writer:  # killed just before its last word
            writer.finish()
        checkpoint = dataclasses.replace(checkpoint, complete=True)
    if checkpoint.complete:
        end = checkpoint.step * checkpoint.time_step
        print(f"{path} is complete ({checkpoint.step} steps to t = {end:g} s): nothing to do.")
        return 0
    with jax.enable_x64(checkpoint.parameters.get("dtype") != "float32"):
        scene = _restored(path, checkpoint)
        model = scene.model(scene.state, options.capacity_margin)
        writer = TrajectoryWriter.append_to(path)
        return _simulate(options, scene, model, writer, max(0, checkpoint.step))


def _restored(path: Path, checkpoint: Checkpoint) -> Scene:
    """The scene of a file, its particles as they were last stored."""
    state = checkpoint.state
    rule = checkpoint.parameters.get("arrangement", {}).get("rule")
    spared = Lattice() if state is not None and rule in _COSTLY else None
    scene = scene_from_record(checkpoint.scene, checkpoint.parameters, spared)
    same = ("time_step", "steps", "steps_per_snapshot")
    fits = all(getattr(scene, name) == getattr(checkpoint, name) for name in same)
    if state is not None:
        fits = fits and state.position.shape == scene.state.position.shape
        scene = dataclasses.replace(scene, state=jax.tree.map(jnp.asarray, state))
    if not fits:
        raise ValueError(
            f"{path}: scene {checkpoint.scene} now has other steps or particles than when the file "
            "was written; resume with the version of jaxsph that wrote it, or run it anew."
        )
    return scene


class _Progress:
    """Hands snapshots on to a file and shows their kinetic energy beside a progress bar."""

    def __init__(self, writer: TrajectoryWriter, bar: tqdm, mass: float, unit: str):
        self.writer, self.bar, self.mass, self.unit = writer, bar, mass, unit

    def append(self, step, time, snapshot):
        self.writer.append(step, time, snapshot)
        energy = float(kinetic_energy(snapshot.velocity, self.mass))
        self.bar.set_postfix_str(f"kinetic energy {energy:.4g} {self.unit}", refresh=False)


def _simulate(options, scene: Scene, model, writer: TrajectoryWriter, first_step: int) -> int:
    """Run, record, and tell how it went."""
    metadata = {"scene": scene.name, "parameters": scene.parameters}
    if first_step:
        metadata["resumed_from_step"] = first_step
    bar = tqdm(
        total=scene.steps,
        initial=first_step,
        unit="step",
        file=sys.stderr,
        mininterval=0.1 if sys.stderr.isatty() else 10.0,  # spare log files
    )
    unit = "J" if scene.space.box.dim == 3 else "J/m"
    try:
        with writer, bar:
            trajectory = simulate(
                model,
                scene.state,
                time_step=scene.time_step,
                steps=scene.steps,
                steps_per_snapshot=scene.steps_per_snapshot,
                first_step=first_step,
                recorder=_Progress(writer, bar, float(scene.mass), unit),
                progress=bar.update,
                metadata=metadata,
                stepping=STEPPING[options.steps],
            )
            writer.finish(trajectory.metadata)
    except (SimulationError, TrajectoryFileError) as error:
        return fail("jaxsph", f"{error} {_holds(writer)}", 1)
    except KeyboardInterrupt:
        return fail("jaxsph", f"interrupted. {_holds(writer)} Go on with --resume.", 130)
    results = _results(scene, trajectory, writer.path)
    if options.json is not None:
        options.json.parent.mkdir(parents=True, exist_ok=True)
        options.json.write_text(json.dumps({**results, **environment()}, indent=2) + "\n")
    _print_table(results)
    return 0


def _holds(writer: TrajectoryWriter) -> str:
    if writer.last_time is None:
        return f"{writer.path} holds no snapshot."
    return f"{writer.path} holds the snapshots up to t = {writer.last_time:.6g} s."


def _results(scene: Scene, trajectory: Trajectory, path: Path) -> dict[str, Any]:
    metadata = trajectory.metadata
    work = trajectory.particles * metadata["steps"]
    return {
        "scene": scene.name,
        "parameters": scene.parameters,
        "dtype": str(trajectory.position.dtype),
        "particles": trajectory.particles,
        "steps": metadata["steps"],
        "first_step": metadata.get("resumed_from_step", 0),
        "end_time": float(trajectory.time[-1]),
        "run_seconds": metadata["run_seconds"],
        "compile_seconds": metadata["compile_seconds"],
        "microseconds_per_particle_and_step": 1e6 * metadata["run_seconds"] / work,
        "errors": _errors(scene, trajectory),
        "trajectory": str(path),
    }


def _errors(scene: Scene, trajectory: Trajectory) -> dict[str, float] | None:
    """Relative errors at the end, where the scene has an exact solution."""
    if scene.name != "taylor-green":
        return None
    time, density = float(trajectory.time[-1]), float(scene.fluid.reference_density)
    viscosity = 1.0 / scene.parameters["reynolds"]
    velocity = np.asarray(trajectory.velocity[-1], np.float64)
    exact = np.asarray(taylor_green_exact.velocity(trajectory.position[-1], time, viscosity))
    energy = float(taylor_green_exact.kinetic_energy(time, viscosity, density))
    found = float(kinetic_energy(velocity, float(scene.mass)))
    return {
        "velocity_relative_l2": float(np.linalg.norm(velocity - exact) / np.linalg.norm(exact)),
        "kinetic_energy_relative": abs(found - energy) / energy,
    }


def _print_table(results: dict[str, Any]) -> None:
    rows = {
        "particles": f"{results['particles']}",
        "steps": f"{results['steps']}, to t = {results['end_time']:g} s",
        "run": f"{results['run_seconds']:.3g} s",
        "compile": f"{results['compile_seconds']:.3g} s",
        "per particle and step": f"{results['microseconds_per_particle_and_step']:.3g} us",
    }
    if results["errors"] is not None:
        velocity, energy = results["errors"].values()
        rows["velocity error"] = f"{100.0 * velocity:.3g} % (relative L2, at the end)"
        rows["kinetic energy error"] = f"{100.0 * energy:.3g} % (at the end)"
    rows["trajectory"] = results["trajectory"]
    for name, value in rows.items():
        print(f"{name:22} {value}")
