"""A run on the command line: shown as it goes, recorded, and reported at its end."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from jaxsph_command.config import repeating
from jaxsph_command.errors import fail

from ..clumping import Clumping
from ..devices import Devices
from ..environment import environment
from ..history import energy_unit
from ..integrate import Model, SimulationError
from ..io import TrajectoryFileError, TrajectoryWriter, read_overview
from ..metrics import kinetic_energy
from ..progress import progress_bar
from ..report.force_rows import force_rows
from ..scenes import Scene
from ..simulate import simulate
from ..trajectory import Trajectory
from ..wall_forces import WallForces, named
from .options import STEPPING, print_rows, write_json

REPORT = "report.html"  # its name, beside the trajectory


def simulate_and_report(
    options, scene: Scene, model: Model, writer: TrajectoryWriter, first_step: int
) -> int:
    """Run, record, and tell how it went; the exit code.

    Args:
        options: of the command.
        scene: with the particles as they are at the first step.
        model: made for the scene.
        writer: of the trajectory file; it is closed at the end.
        first_step: 0, or where a resumed run goes on.
    """
    metadata = {"scene": scene.name, "parameters": scene.parameters}
    if first_step:
        metadata["resumed_from_step"] = first_step
    forces = WallForces.of(scene)
    devices = None if options.devices is None else Devices.first(options.devices).every
    bar = progress_bar(scene.steps, "step", first_step)
    try:
        with writer, bar:
            trajectory = simulate(
                model,
                scene.state,
                scene.schedule,
                first_step=first_step,
                recorder=_Progress(writer, bar, scene),
                progress=bar.update,
                metadata=metadata,
                stepping=STEPPING[options.steps],
                measure=forces,
                averaged=named(forces),
                watch=Clumping(scene.space),
                devices=devices,
            )
            writer.finish(trajectory.metadata)
    except SimulationError as error:
        _report(options, scene, writer, {"fault": str(error)})
        return fail("jaxsph", f"{error} {_holds(writer)}", 1)
    except TrajectoryFileError as error:  # the disk takes no more, so no report either
        return fail("jaxsph", f"{error} {_holds(writer)}", 1)
    except KeyboardInterrupt:
        return fail("jaxsph", f"interrupted. {_holds(writer)} Go on with --resume.", 130)
    overview = read_overview(writer.path)
    results = {**_results(scene, trajectory, writer.path), "forces": overview.forces}
    results["devices"] = options.devices or 1
    write_json(options.json, {**results, **environment()})
    rows = {**_rows(results), **force_rows(overview), "trajectory": results["trajectory"]}
    print_rows({**rows, "report": str(_report(options, scene, writer, rows))})
    return 0


def _report(options, scene: Scene, writer: TrajectoryWriter, rows: dict[str, str]) -> Path:
    from ..report.run_report import write_run_report  # matplotlib takes its time to load

    path, rows = writer.path.with_name(REPORT), {**rows, "trajectory": writer.path.name}
    told = float(scene.mass), rows, environment(), repeating(options)
    return write_run_report(path, writer.path, *told)


class _Progress:
    """Hands snapshots on to a file and shows their kinetic energy beside a progress bar."""

    def __init__(self, writer: TrajectoryWriter, bar: tqdm, scene: Scene):
        self.writer, self.bar, self.mass = writer, bar, float(scene.mass)
        self.unit = energy_unit(scene.space.box.dim)

    def append(self, step, time, snapshot):
        self.writer.append(step, time, snapshot)
        if step == 0:
            return  # nothing is compiled yet
        energy = float(kinetic_energy(snapshot.velocity, self.mass))
        self.bar.set_postfix_str(f"kinetic energy {energy:.4g} {self.unit}", refresh=False)


def _holds(writer: TrajectoryWriter) -> str:
    if writer.last_time is None:
        return f"{writer.path} holds no snapshot."
    return f"{writer.path} holds the snapshots up to t = {writer.last_time:.6g} s."


def _results(scene: Scene, trajectory: Trajectory, path: Path) -> dict[str, Any]:
    timing = trajectory.timing
    work = trajectory.particles * timing.steps
    return {
        "scene": scene.name,
        "parameters": scene.parameters,
        "dtype": str(trajectory.position.dtype),
        "particles": trajectory.particles,
        "steps": timing.steps,
        "first_step": trajectory.metadata.get("resumed_from_step", 0),
        "end_time": float(trajectory.time[-1]),
        "run_seconds": timing.run_seconds,
        "compile_seconds": timing.compile_seconds,
        "microseconds_per_particle_and_step": 1e6 * timing.run_seconds / work,
        "errors": _errors(scene, trajectory),
        "doubt": trajectory.metadata.get("doubt"),
        "doubt_time": trajectory.metadata.get("doubt_time"),
        "trajectory": str(path),
    }


def _errors(scene: Scene, trajectory: Trajectory) -> dict[str, float] | None:
    """Relative errors at the end, over the particles, where the scene has an exact flow."""
    if scene.exact is None:
        return None
    last = trajectory.snapshot(-1).in_flow()
    exact, _ = scene.exact(last.position, float(trajectory.time[-1]))
    exact, velocity = (np.asarray(u, np.float64) for u in (exact, last.velocity))
    energy, found = (float(kinetic_energy(u, float(scene.mass))) for u in (exact, velocity))
    if energy == 0.0:  # an exact flow at rest: nothing to be relative to
        return None
    return {
        "velocity_relative_l2": float(np.linalg.norm(velocity - exact) / np.linalg.norm(exact)),
        "kinetic_energy_relative": abs(found - energy) / energy,
    }


def _rows(results: dict[str, Any]) -> dict[str, str]:
    """Results as they are shown to people."""
    first = f"from step {results['first_step']} " if results["first_step"] else ""
    rows = {
        "particles": f"{results['particles']}",
        "steps": f"{results['steps']}, {first}to t = {results['end_time']:g} s",
        "run": f"{results['run_seconds']:.3g} s",
        "compile": f"{results['compile_seconds']:.3g} s",
        "per particle and step": f"{results['microseconds_per_particle_and_step']:.3g} us",
    }
    if results["devices"] > 1:
        rows["devices"] = f"{results['devices']}, each its share of the particles"
    if results["errors"] is not None:
        velocity, energy = results["errors"].values()
        rows["velocity error"] = f"{100.0 * velocity:.3g} % (relative L2, at the end)"
        rows["kinetic energy error"] = f"{100.0 * energy:.3g} % (at the end)"
    if results["doubt"] is not None:
        rows["not to be believed"] = f"from t = {results['doubt_time']:.4g} s: {results['doubt']}"
    return rows
