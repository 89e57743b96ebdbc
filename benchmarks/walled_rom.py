"""Reduced models between walls on reference points: error beside the noise of the full model.

    python -m benchmarks.walled_rom lid-driven-cavity

Trained and run at the Reynolds numbers of the scene's plan, in both formulations, with and without
a linear closure. Discrepancies are those on the paper's line of probes and those over all reference
points, from `--from` seconds on; what a sudden start does before is told apart. Beside them stand
the floor, which is what the model's own fields make of the full run's projection, and the full
model's sound: the part of its pressure faster than c0 / (2 L), which a solenoidal model has not.
The full run is probed by moving least squares, as Shepard's map is one-sided at walls. Runs are
kept in a folder and finished rows in the JSON file: the same command goes on.
"""

from __future__ import annotations

import dataclasses
from functools import cache, partial
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxsph import SimulationError, Trajectory
from jaxsph.cli import SCALES, positive_float, positive_int
from jaxsph.environment import environment
from jaxsph.interpolation import MovingLeastSquaresMap
from jaxsph.metrics import phase_error, probe, relative_discrepancy
from jaxsph.scenes import SCENES, Scene
from jaxsph.schemes import DeltaPlus
from jaxsph_rom import low_pass
from jaxsph_rom.points import (
    Compressible,
    Family,
    LinearClosure,
    Solenoidal,
    TrainedModel,
    mapped_run,
    train_each,
)
from jaxsph_rom.points.dynamics.log_density import from_log_density
from jaxsph_rom.points.training.linear_closure import held_back
from jaxsph_rom.study import PLANS, full_run

from .measure import format_rows, number, progress, repeated, summary, tell
from .table import Table, command

FORMULATIONS = {"compressible": Compressible(), "solenoidal": Solenoidal()}
CLOSURES = ("none", "linear")
KEY = ("formulation", "closure", "modes", "reynolds")
_REPEATS = 5


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: a full run failed, 2: bad input."""
    return command(
        "walled_rom", __doc__, _arguments, _run, argv, json="walled_rom_{scene}_{scale}.json"
    )


def _arguments(add) -> None:
    scenes = ("lid-driven-cavity", "open-cavity")
    add("scene", choices=scenes, metavar="SCENE", help=f"one of {', '.join(scenes)}")
    add("--scale", choices=SCALES, default="small", help="size of the runs (default: small)")
    add("--resolution", type=positive_int, metavar="N", help="instead of the scale's")
    add("--end-time", type=positive_float, metavar="T", help="[s], instead of the scene's")
    add("--settling", type=positive_float, metavar="T", help="[s], instead of the plan's")
    add("--train", type=positive_float, nargs="+", metavar="RE",
        help="Reynolds numbers to train on (default: the plan's)")  # fmt: skip
    add("--predict", type=positive_float, nargs="+", metavar="RE",
        help="Reynolds numbers to run at (default: the plan's)")  # fmt: skip
    add("--modes", type=positive_int, nargs="+", metavar="M",
        help="numbers of modes (default: the plan's)")  # fmt: skip
    add("--formulations", choices=tuple(FORMULATIONS), nargs="+", default=list(FORMULATIONS),
        help="default: both")  # fmt: skip
    add("--closures", choices=CLOSURES, nargs="+", default=list(CLOSURES), help="default: both")
    add("--iterations", type=positive_int, default=600, metavar="K",
        help="of the closure's training (default: %(default)s)")  # fmt: skip
    add("--from", type=float, default=0.5, dest="judged_from", metavar="T",
        help="time from which on discrepancies count [s] (default: %(default)g)")  # fmt: skip
    add("--out", type=Path, metavar="DIR",
        help="where runs are kept (default: out/walled-rom-SCENE-SCALE)")  # fmt: skip


def _run(options) -> None:
    names = ("scene", "scale", "resolution", "end_time", "settling", "train", "iterations")
    settings = {name: getattr(options, name) for name in (*names, "judged_from")}
    kept = Table(options.json, KEY, settings=settings)
    plan = PLANS[options.scene]
    train = tuple(options.train or plan.train)
    predict, sizes = options.predict or plan.predict, options.modes or plan.modes
    folder = options.out or Path("out", f"walled-rom-{options.scene}-{options.scale}")
    family = _maker(options, folder)
    scenes = {re: family.make(re) for re in sorted({*train, *predict})}
    runs = {re: full_run(folder / "full", scene, progress) for re, scene in scenes.items()}
    first = scenes[train[0]]
    line = plan.probes(first)
    truths = {re: _Truth(scenes[re], runs[re], line) for re in predict}
    kept.results |= {
        "particles": runs[train[0]].particles,
        "parameters": first.parameters,
        "trained_on": train,
        "device": jax.devices()[0].device_kind,
        "environment": environment(),
    }
    for formulation in options.formulations:
        for closure in options.closures:
            left = [
                modes
                for modes in sizes
                if not all(kept.has((formulation, closure, modes, re)) for re in predict)
            ]
            if not left:
                continue
            tell(f"training: {formulation}, closure {closure}")
            parameters = [{"reynolds": re} for re in sorted(train, reverse=True)]
            learnt = LinearClosure(held_back(parameters), iterations=options.iterations)
            flows = train_each(
                family,
                parameters,
                left,
                runs=[runs[named["reynolds"]] for named in parameters],
                formulation=FORMULATIONS[formulation],
                closure=learnt if closure == "linear" else None,
                progress=progress,
            )
            for trained in flows:
                case = {"formulation": formulation, "closure": closure,
                        "modes": trained.flow.basis.size}  # fmt: skip
                for re in predict:
                    if kept.has(case | {"reynolds": re}):
                        continue
                    row = case | {"reynolds": re, "predicted": re not in train}
                    row |= _judged(trained, scenes[re], runs[re], truths[re], options.judged_from)
                    kept.add(row | _offline(trained))
    print(_table(kept.results))


def _maker(options, folder: Path) -> Family:
    """The scenes of any Reynolds number, settled first where the plan says so."""
    plan = PLANS[options.scene]
    settings = {"scale": options.scale, "resolution": options.resolution, "scheme": DeltaPlus(),
                "dtype": "float64"}  # fmt: skip
    if options.end_time is not None:
        settings["end_time"] = options.end_time
    scene = partial(SCENES[options.scene], **settings)
    if plan.settling is None:
        return Family(lambda reynolds: scene(reynolds=reynolds))
    settling = options.settling or plan.settling
    made = dataclasses.replace(plan, settling=settling)
    settled = cache(made.scenes(scene, folder, progress))
    return Family(
        lambda reynolds: settled(reynolds=reynolds),
        starts=False,
        probe=lambda reynolds: scene(reynolds=reynolds, start_time=settling),
    )


class _Truth:
    """A full run on the line and on the reference points: velocity norm and pressure over time."""

    def __init__(self, scene: Scene, run: Trajectory, line: np.ndarray):
        self.line = line
        self.on_line = probe(run, line, scene.space, MovingLeastSquaresMap)
        self.fields: np.ndarray | None = None  # (r, u) on the reference points, mapped once
        self.sound: dict[str, np.ndarray] = {}

    def everywhere(self, trained: TrainedModel, scene: Scene, run: Trajectory):
        """The same on the reference points; the pressure's fast part is kept as `sound`."""
        flow = trained.flow
        if self.fields is None:
            self.fields = mapped_run(flow.reference, run, scene.fluid)
        density = from_log_density(jnp.asarray(self.fields[:, 0].T), flow.fluid)
        pressure = np.asarray(flow.fluid.pressure(density))
        if not self.sound:
            cutoff = float(scene.fluid.sound_speed) / (2.0 * max(scene.space.box.lengths))
            for name, values in (("points", pressure), ("line", self.on_line[1])):
                slow = low_pass(values.T[:, None, :], run.time, cutoff)[:, 0].T
                self.sound[name] = relative_discrepancy(values, slow)
        return np.linalg.norm(self.fields[:, 1:], axis=1).T, pressure


def _judged(
    trained: TrainedModel, scene: Scene, run: Trajectory, truth: _Truth, judged_from: float
) -> dict[str, Any]:
    """Errors on the line and over all points, floors, the full model's sound, and times."""
    flow = trained.flow
    on_points = truth.everywhere(trained, scene, run)
    projected = flow.project(truth.fields)
    arguments = 1.0 / scene.parameters["reynolds"], scene.schedule
    seconds, fault, found = [], None, None
    try:
        found, _, seconds = repeated(lambda: flow.predict(projected[0], *arguments), _REPEATS)
    except SimulationError as error:
        fault = str(error)
    timing = run.timing
    row = {
        "stable": fault is None,
        "fault": fault,
        "rom_seconds": summary(seconds),
        "fom_seconds": timing.seconds(scene.steps),
        "steps": scene.steps,
    }
    late = run.time >= judged_from
    coordinates = {"floor_": projected}
    if found is not None:
        coordinates[""] = jnp.concatenate([projected[:1], found])
    for prefix, values in coordinates.items():
        for place, points, wanted in (
            ("points", None, on_points), ("line", truth.line, truth.on_line)
        ):  # fmt: skip
            fields = flow.fields(values, run.time, points)
            ours = np.linalg.norm(fields.velocity, axis=2), fields.pressure
            if scene.parameters.get("start_time") and place == "line":  # it goes on for ever
                degrees, frequency = phase_error(run.time, wanted[0], ours[0])
                row |= {f"{prefix}phase_error_degrees": degrees, "frequency": frequency}
            for name, a, b in zip(("velocity", "pressure"), wanted, ours, strict=True):
                percent = relative_discrepancy(a, b)
                row |= _figures(f"{prefix}{name}_on_{place}", percent, late)
    for place, percent in truth.sound.items():
        row |= _figures(f"sound_on_{place}", percent, late)
    return row


def _figures(name: str, percent: np.ndarray, late: np.ndarray) -> dict[str, float | None]:
    """Peak and median of the time that counts, and the peak before it, the first snapshot apart."""
    early = percent[1:][~late[1:]]
    return {
        f"{name}_peak_percent": float(percent[late].max()),
        f"{name}_median_percent": float(np.median(percent[late])),
        f"{name}_start_peak_percent": float(early.max()) if len(early) else None,
    }


def _offline(trained: TrainedModel) -> dict[str, Any]:
    names = ("offline_seconds", "closure_seconds", "held_back", "loss", "held_back_loss")
    return {name: trained.training.get(name) for name in names}


def _table(results: dict[str, Any]) -> str:
    header = ("Re", "M", "formulation", "closure", "u line %", "u all %", "p line %", "median",
              "floor", "p all %", "median", "floor", "sound", "median", "phase deg", "full s",
              "reduced ms", "stable")  # fmt: skip
    rows = []
    for row in results["rows"]:
        seconds = row["rom_seconds"]["median"]
        rows.append((
            f"{row['reynolds']:g}", str(row["modes"]), row["formulation"], row["closure"],
            *(number(row.get(f"{name}_percent")) for name in (
                "velocity_on_line_peak", "velocity_on_points_peak", "pressure_on_line_peak",
                "pressure_on_line_median", "floor_pressure_on_line_median",
                "pressure_on_points_peak", "pressure_on_points_median",
                "floor_pressure_on_points_median", "sound_on_points_peak",
                "sound_on_points_median")),
            number(row.get("phase_error_degrees")), number(row["fom_seconds"]),
            number(None if seconds is None else 1e3 * seconds), "yes" if row["stable"] else "no",
        ))  # fmt: skip
    start = results["settings"]["judged_from"]
    return f"discrepancies from t = {start:g} s, {results['particles']} particles\n" + format_rows(
        header, rows
    )


if __name__ == "__main__":
    raise SystemExit(main())
