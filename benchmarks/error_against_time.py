"""Error against run time: full models of several resolutions and reduced models, on the same axes.

    python -m benchmarks.error_against_time --scale small

The Taylor-Green vortex of `benchmarks.tensor_rom` at a Reynolds number that nothing was trained on:
full models, the source paper's reduced model on moving particles (and the same in the energy
product), models on reference points without and with a closure. Errors on the centre line, against
the exact solution and against the full model of the scale's own resolution; offline cost, after how
many runs it is paid back, and how much faster a reduced model is than the cheapest full model that
is as near to the exact solution. Full runs are those of `benchmarks.tensor_rom` if there are any.
"""

from __future__ import annotations

import argparse
import dataclasses
import math
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxsph import SimulationError, Trajectory
from jaxsph.cli import SCALES, positive_float, positive_int
from jaxsph.environment import environment
from jaxsph.metrics import centre_line, probe
from jaxsph.plotting.style import (
    BLACK,
    BLUE,
    GREEN,
    VERMILLION,
    dress,
    legend_below,
    save,
    sheet,
)  # fmt: skip
from jaxsph.scenes import Scene
from jaxsph_rom import FAITHFUL as PAPERS
from jaxsph_rom import Energy, Euclidean, Experiment, Study
from jaxsph_rom.points import LinearClosure, TrainedModel, mapped_run, train_each
from jaxsph_rom.study import full_run

from .measure import format_rows, number, progress, repeated, summary, tell, write_json
from .reduced_vortex import HELD_BACK, TRAINED_ON, discrepancies, make_scene
from .table import command

REYNOLDS = 175.0
FULL, FAITHFUL, TENSOR, CLOSED = "full", "on moving particles", "tensor", "tensor, closure"
MARKS = {FULL: (BLACK, "o"), FAITHFUL: (VERMILLION, "s"), TENSOR: (BLUE, "^"), CLOSED: (GREEN, "D")}
SHARES = (4, 3, 2, 1)  # full models have the scale's resolution over these
MOVING = ((Euclidean, 5), (Energy, 3))  # product and modes of the models on moving particles
_REPEATS = 9


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: a full run failed, 2: bad input."""
    return command(
        "error_against_time",
        __doc__,
        _arguments,
        _run,
        argv,
        json="error_against_time_{scale}.json",
    )


def _run(options) -> None:
    results = _measured(options)
    write_json(options.json, results)
    figure(results["rows"], options.figure)
    print(_table(results))


def _arguments(add) -> None:
    add("--scale", choices=SCALES, default="small", help="size of the runs (default: small)")
    add("--resolution", type=positive_int, metavar="N", help="instead of the scale's")
    add("--end-time", type=positive_float, default=1.0, metavar="T", help="[s] (default: 1)")
    add("--reynolds", type=positive_float, default=REYNOLDS, metavar="RE",
        help="to run at (default: %(default)g)")  # fmt: skip
    add("--train", type=positive_float, nargs="+", default=list(TRAINED_ON), metavar="RE",
        help="to train on (default: 100 150 200 250)")  # fmt: skip
    add("--modes", type=positive_int, nargs="+", default=[5, 10, 20], metavar="M",
        help="of the models on reference points (default: 5 10 20)")  # fmt: skip
    add("--iterations", type=positive_int, default=600, metavar="K",
        help="of the closure's training (default: %(default)s)")  # fmt: skip
    add("--skip-moving", action="store_true", help="leave out the models on moving particles")
    add("--out", type=Path, metavar="DIR",
        help="where runs are kept (default: out/tensor-rom-SCALE)")  # fmt: skip
    add("--figure", type=Path, default=Path("docs/figures/error_against_time.png"), metavar="FILE",
        help="default: %(default)s")  # fmt: skip


def _measured(options) -> dict[str, Any]:
    folder = options.out or Path("out", f"tensor-rom-{options.scale}")
    numbers = sorted({*options.train, options.reynolds})
    scenes = {re: make_scene(options, re) for re in numbers}
    runs = {re: full_run(folder / "full", scene, progress) for re, scene in scenes.items()}
    judge = _Judge(scenes[options.reynolds], runs[options.reynolds])
    rows = list(_full_rows(options, folder, judge))
    if not options.skip_moving:
        rows += _moving_rows(options, folder, scenes, judge)
    offline = []
    for closure, family in ((None, TENSOR), (_closure(options), CLOSED)):
        flows = train_each(
            lambda reynolds: make_scene(options, reynolds),
            [{"reynolds": re} for re in options.train],
            options.modes,
            runs=[runs[re] for re in options.train],
            closure=closure,
            progress=progress,
        )
        for trained in flows:
            try:
                rows.append(judge.reduced(family, trained))
            except SimulationError as error:  # it has no error to show; the others have
                tell(f"{family}, M = {trained.flow.basis.size}: lost, {error}")
                continue
            offline.append(_offline(family, trained, [runs[re] for re in options.train], rows[-1]))
    for row in rows:
        row |= equal_error(row, rows)
    return {
        "reynolds": options.reynolds,
        "trained_on": options.train,
        "rows": rows,
        "offline": offline,
        "particles": runs[options.reynolds].particles,
        "parameters": scenes[options.reynolds].parameters,
        "device": jax.devices()[0].device_kind,
        "environment": environment(),
    }


def _closure(options) -> LinearClosure:
    held_back = HELD_BACK if HELD_BACK in options.train and len(options.train) > 2 else None
    judge = None if held_back is None else {"reynolds": held_back}
    return LinearClosure(judge, iterations=options.iterations)


class _Judge:
    """The full model at the scale's own resolution and the exact solution, on the centre line."""

    def __init__(self, scene: Scene, run: Trajectory):
        self.scene, self.run, self.line = scene, run, centre_line(scene.space)
        self.full = probe(run, self.line, scene.space)
        self.exact = self._exact(run.time)

    def _exact(self, time) -> tuple[np.ndarray, np.ndarray]:
        fields = [self.scene.exact(self.line, t) for t in time]
        velocity, pressure = (np.stack(field) for field in zip(*fields, strict=True))
        return np.linalg.norm(velocity, axis=2), pressure

    def row(self, family: str, setting: str, profile, seconds) -> dict[str, Any]:
        """A row of the table; `profile` is the velocity norm and pressure on the line over time."""
        count = len(profile[0])
        exact, full = (tuple(a[:count] for a in truth) for truth in (self.exact, self.full))
        return {
            "family": family,
            "setting": setting,
            "seconds": seconds,
            "ends_at": float(self.run.time[count - 1]),
            **discrepancies("exact_", exact, profile),
            **discrepancies("full_", full, profile),
        }

    def reduced(self, family: str, trained: TrainedModel) -> dict[str, Any]:
        """A model on reference points, from the projection of the full run's own start."""
        flow, scene = trained.flow, self.scene
        first = jax.tree.map(lambda field: field[:1], self.run)
        start = flow.project(mapped_run(flow.reference, first, scene.fluid))
        viscosity = 1.0 / scene.parameters["reynolds"]
        found, _, seconds = repeated(
            lambda: flow.predict(start[0], viscosity, scene.schedule), _REPEATS
        )
        fields = flow.fields(jnp.concatenate([start, found]), self.run.time, self.line)
        profile = np.linalg.norm(fields.velocity, axis=2), fields.pressure
        row = self.row(family, f"M = {flow.basis.size}", profile, np.median(seconds))
        return row | {"modes": flow.basis.size, "repeats": summary(seconds)}


def _full_rows(options, folder: Path, judge: _Judge):
    """Full models of several resolutions, their snapshots at the same times."""
    finest = judge.scene.parameters["resolution"]
    interval = judge.scene.schedule.interval
    for share in SHARES:
        resolution = finest // share
        if share == 1:
            scene, run = judge.scene, judge.run
        else:
            coarse = argparse.Namespace(**{**vars(options), "resolution": resolution})
            free = make_scene(coarse, options.reynolds)
            each = math.ceil(interval / free.time_step - 1e-9)
            scene = make_scene(coarse, options.reynolds, time_step=interval / each)
            scene = dataclasses.replace(scene, steps_per_snapshot=each)
            run = full_run(folder / f"full-{resolution}", scene, progress)
        profile = probe(run, judge.line, scene.space)
        row = judge.row(FULL, f"{resolution} x {resolution}", profile, _seconds(scene, run))
        yield row | {"resolution": resolution}


def _moving_rows(options, folder: Path, scenes: dict[float, Scene], judge: _Judge):
    for product, modes in MOVING:
        study = Study(
            scenes.__getitem__,
            folder,
            dataclasses.replace(PAPERS, product=product()),
            progress=progress,
        )
        experiment = Experiment(tuple(options.train), (options.reynolds,), (modes,))
        for outcome in study.run(experiment):
            setting = f"M = {modes}, {product.__name__} product"
            row = judge.row(FAITHFUL, setting, outcome.profile, outcome.case.rom_seconds)
            yield row | {"modes": modes, "product": product.__name__}


def _offline(family: str, trained: TrainedModel, runs, row) -> dict[str, Any]:
    """What a model cost before its first run, and after how many runs that is paid back."""
    training = trained.training
    parts = {
        "full_runs_s": sum(r.timing.run_seconds for r in runs),
        "training_s": training["offline_seconds"],
        "closure_s": training.get("closure_seconds", 0.0),
    }
    saved = runs[0].timing.run_seconds - row["seconds"]
    paid_back = math.ceil(sum(parts.values()) / saved) if saved > 0.0 else None
    return {"family": family, "modes": row["modes"], **parts, "paid_back_after_runs": paid_back}


def equal_error(row: dict[str, Any], rows: list[dict[str, Any]]) -> dict[str, Any]:
    """How much faster a reduced model is than the full one, and than the cheapest as good as it.

    As good: its velocity and its pressure are as near to the exact solution. Where no full model
    that was run is, the finest bounds the ratio from below.
    """
    if row["family"] == FULL or row["seconds"] is None:
        return {}
    names = ("exact_velocity_peak_percent", "exact_pressure_median_percent")
    full = [r for r in rows if r["family"] == FULL]
    as_good = [r for r in full if all(r[name] <= row[name] for name in names)]
    finest = max(full, key=lambda r: r["resolution"])
    best = min(as_good, key=lambda r: r["seconds"], default=finest)
    return {
        "faster_than_full": finest["seconds"] / row["seconds"],
        "as_good_full": best["setting"] if as_good else f"beyond {finest['setting']}",
        "faster_than_as_good_full": best["seconds"] / row["seconds"],
    }


def _seconds(scene: Scene, run: Trajectory) -> float:
    return run.timing.seconds(scene.steps)


def figure(rows: list[dict[str, Any]], path: Path) -> Path:
    """Error against the exact solution over run time, velocity left and pressure right."""
    made = sheet(10, 4.4)
    panels = made.subplots(1, 2)
    names = (("exact_velocity_peak_percent", "velocity norm, peak over time"),
             ("exact_pressure_median_percent", "pressure, median over time"))  # fmt: skip
    handles = {}
    for axes, (name, title) in zip(panels, names, strict=True):
        dress(axes, "run time [s]", "error against the exact solution [%]", title)
        axes.set(xscale="log", yscale="log")
        axes.yaxis.set_major_formatter("{x:g}")
        axes.yaxis.set_minor_formatter("{x:g}")
        for family, (color, marker) in MARKS.items():
            of_family = [r for r in rows if r["family"] == family and r["seconds"] is not None]
            points = [(r["seconds"], r[name], _label(r)) for r in of_family]
            if not points:
                continue
            x, y, labels = zip(*points, strict=True)
            (handles[family],) = axes.plot(
                x, y, color=color, marker=marker, linestyle="-" if family == FULL else "",
                linewidth=1.2, markersize=6, label=family,
            )  # fmt: skip
            for at_x, at_y, label in points:
                axes.annotate(
                    label, (at_x, at_y), textcoords="offset points", color=color, fontsize=7.5,
                    xytext=(-3, -13) if family == TENSOR else (5, 5),
                )  # fmt: skip
    legend_below(made, list(handles.values()))
    return save(made, path)


def _label(row: dict[str, Any]) -> str:
    if row["family"] == FULL:
        return f"{row['resolution']}²"
    return f"{row['modes']}" + (f" {row['product'].lower()}" if "product" in row else "")


def _table(results: dict[str, Any]) -> str:
    header = ("family", "setting", "velocity %", "of full", "pressure %", "of full", "run s",
              "times faster", "than as good", "which is")  # fmt: skip
    rows = [
        (
            row["family"], row["setting"], number(row["exact_velocity_peak_percent"]),
            number(row["full_velocity_peak_percent"]), number(row["exact_pressure_median_percent"]),
            number(row["full_pressure_median_percent"]), number(row["seconds"]),
            number(row.get("faster_than_full")), number(row.get("faster_than_as_good_full")),
            row.get("as_good_full") or "-",
        )
        for row in results["rows"]
    ]  # fmt: skip
    costs = [
        (row["family"], str(row["modes"]), *(number(row[name]) for name in (
            "full_runs_s", "training_s", "closure_s")), str(row["paid_back_after_runs"] or "-"))
        for row in results["offline"]
    ]  # fmt: skip
    return (
        f"Re {results['reynolds']:g}, {results['particles']} particles: velocity peak and pressure "
        "median over time,\nagainst the exact solution and against the full model\n"
        + format_rows(header, rows)
        + "\n\noffline\n"
        + format_rows(
            ("family", "M", "full runs s", "training s", "closure s", "paid back after"), costs
        )
    )


if __name__ == "__main__":
    raise SystemExit(main())
