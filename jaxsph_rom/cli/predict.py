"""`jaxsph-rom predict FILE`: a reduced model at any number of Reynolds numbers."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import jax
import numpy as np

from jaxsph.cli import fail, positive_float, positive_int, print_rows, reynolds_numbers, seed
from jaxsph.cli.options import MOST_NUMBERS
from jaxsph.environment import environment
from jaxsph.integrate import SimulationError, explanation
from jaxsph.io import check_target

from ..hyper import Prediction, TrainedFlow, load_flow, save_prediction
from ..hyper.member_files import write_fields, write_tracers
from ..report.plain import plain
from .options import bar, distinct
from .train import print_errors

_MOST_FILES = 100  # with fields or tracers
_MOST_BYTES = 4 * 2**30  # of all coordinates
_FAULTS_SHOWN = 5


def add_to(commands) -> None:
    """Add the command to a parser's commands."""
    predict = commands.add_parser(
        "predict",
        help="run the file of a reduced model at any Reynolds numbers",
        description="Run a model that `jaxsph-rom train` made at any number of Reynolds numbers at "
        "once, and write their coordinates over time to DIR/prediction.h5.",
    )
    predict.set_defaults(command=_predict)
    add = predict.add_argument
    add("model", type=Path, metavar="FILE", help="of the model")
    add("--reynolds", type=reynolds_numbers, nargs="+", required=True, metavar="RE",
        help="Reynolds numbers, or START:STOP:COUNT for COUNT of them, evenly spaced")  # fmt: skip
    add("--t-end", type=positive_float, metavar="T",
        help="end time [s] (default: that of the training runs)")  # fmt: skip
    add("--fields", action="store_true",
        help="write fields at the reference points to DIR/fields "
        f"(up to {_MOST_FILES} runs)")  # fmt: skip
    add("--tracers", type=positive_int, metavar="N",
        help="write N particles carried by the flow to DIR/tracers; they start at reference points "
        f"drawn by --seed, at each of them if N is larger (up to {_MOST_FILES} runs)")  # fmt: skip
    add("--seed", type=seed, default=0, metavar="N", help="of the draw (default: 0)")
    add("--out", type=Path, metavar="DIR", help="folder for results (default: out/predict-MODEL)")
    add("--json", type=Path, metavar="FILE", help="write what the table says to FILE as well")


def _predict(options) -> int:
    folder = options.out or Path("out", f"predict-{options.model.stem}")
    path = folder / "prediction.h5"
    for target in (path, options.json):
        if target is not None:
            check_target(target)
    with jax.enable_x64(True):  # whatever the file holds is kept
        trained = load_flow(options.model)
    with jax.enable_x64(trained.starts.dtype == np.float64):
        reynolds = np.array(distinct(value for part in options.reynolds for value in part))
        snapshots = trained.snapshots
        if options.t_end is not None:
            snapshots = trained.intervals_to(options.t_end)
        _check(options, trained, reynolds, snapshots)
        _warn(trained, reynolds, snapshots)
        with bar(f"Re, M = {trained.flow.basis.size}", len(reynolds)) as report:
            prediction = trained.predict(reynolds, snapshots, report)
        save_prediction(path, prediction, options.model.name)
        lost = _write_members(options, trained, prediction, folder)
    results = _results(options, trained, prediction, path)
    if options.json is not None:
        options.json.parent.mkdir(parents=True, exist_ok=True)
        text = json.dumps(plain({**results, **environment()}), indent=2)
        options.json.write_text(text + "\n")
    _print(results, trained, prediction)
    return fail("jaxsph-rom", lost, 1) if lost else 0


def _check(options, trained: TrainedFlow, reynolds: np.ndarray, snapshots: int) -> None:
    """A ValueError for what asks too much."""
    count = len(reynolds)
    if count > MOST_NUMBERS:
        raise ValueError(f"--reynolds: {count} of them; give at most {MOST_NUMBERS} a call.")
    size = count * (snapshots + 1) * trained.starts[0].nbytes
    if size > _MOST_BYTES:
        raise ValueError(
            f"--reynolds: {count} of them over {snapshots} snapshots make {size / 2**30:.3g} GiB; "
            "give fewer or an earlier --t-end."
        )
    for name in ("fields", "tracers"):
        if getattr(options, name) and count > _MOST_FILES:
            raise ValueError(
                f"--{name}: writes a file for each of {count} Reynolds numbers; give at most "
                f"{_MOST_FILES}, or make fields of prediction.h5 by `TrainedFlow.fields`."
            )


def _warn(trained: TrainedFlow, reynolds: np.ndarray, snapshots: int) -> None:
    """A line each on stderr for what no training run has seen."""
    low, high = trained.reynolds[[0, -1]]
    outside = int(((reynolds < low * (1 - 1e-6)) | (reynolds > high * (1 + 1e-6))).sum())
    if outside:
        print(f"jaxsph-rom: warning: {outside} of {len(reynolds)} Reynolds numbers are outside "
              f"those trained on, {low:g} to {high:g}.", file=sys.stderr)  # fmt: skip
    if snapshots > trained.snapshots:
        print(f"jaxsph-rom: warning: t = {snapshots * trained.interval:g} s is beyond the training "
              f"runs, which end at {trained.end_time:g} s.", file=sys.stderr)  # fmt: skip


def _write_members(options, trained: TrainedFlow, prediction: Prediction, folder: Path) -> str:
    """Files of single members; what went wrong with tracers, or nothing."""
    names = [f"re-{number:.12g}.h5" for number in prediction.reynolds]
    for member, name in enumerate(names if options.fields else ()):
        write_fields(folder / "fields" / name, trained, prediction, member)
    if options.tracers is None:
        return ""
    points = np.asarray(trained.flow.reference.points)
    count = min(options.tracers, len(points))
    drawn = np.random.default_rng(options.seed).choice(len(points), count, replace=False)
    steps = (len(prediction.time) - 1) * trained.steps_per_snapshot
    lost = ""
    for member, name in enumerate(names):
        number = prediction.reynolds[member]
        try:
            with bar(f"tracers, Re {number:g}", steps) as report:
                target = folder / "tracers" / name
                write_tracers(target, trained, prediction, member, points[np.sort(drawn)], report)
        except SimulationError as error:
            lost = lost or f"tracers, Re {number:g}: {error}"
    return lost


def _results(options, trained: TrainedFlow, prediction: Prediction, path: Path) -> dict[str, Any]:
    lost = np.flatnonzero(prediction.status)
    return {
        "model": options.model,
        "scene": trained.scene,
        "modes": trained.flow.basis.size,
        "training": trained.training,
        "reynolds_numbers": len(prediction.reynolds),
        "reynolds_lowest": prediction.reynolds.min(),
        "reynolds_highest": prediction.reynolds.max(),
        "end_time": prediction.time[-1],
        "steps": (len(prediction.time) - 1) * trained.steps_per_snapshot,
        "run_seconds": prediction.run_seconds,
        "compile_seconds": prediction.compile_seconds,
        "stable": len(prediction.reynolds) - len(lost),
        "faults": [
            {
                "reynolds": prediction.reynolds[k],
                "step": prediction.step[k],
                "fault": explanation(prediction.status[k]),
            }
            for k in lost[:_MOST_FILES]
        ],
        "prediction": path,
    }


def _print(results: dict[str, Any], trained: TrainedFlow, prediction: Prediction) -> None:
    count, low, high = (results[f"reynolds_{name}"] for name in ("numbers", "lowest", "highest"))
    made = trained.training
    trained_on = " ".join(f"{reynolds:g}" for reynolds in trained.reynolds)
    print_rows({
        "model": f"{results['scene']}, M = {results['modes']}, closure {made['closure']}",
        "trained on": f"Re {trained_on}, to t = {trained.end_time:g} s",
        "Reynolds numbers": f"{count}, {low:g} to {high:g}" if count > 1 else f"{low:g}",
        "steps": f"{results['steps']}, to t = {results['end_time']:g} s",
        "run": f"{results['run_seconds']:.3g} s",
        "compile": f"{results['compile_seconds']:.3g} s",
        "stable": f"{results['stable']} of {count}",
        "prediction": str(results["prediction"]),
    })  # fmt: skip
    for fault in results["faults"][:_FAULTS_SHOWN]:
        print(f"  Re {fault['reynolds']:g}, step {fault['step']}: {fault['fault']}")
    if len(results["faults"]) > _FAULTS_SHOWN:
        print("  and more; prediction.h5 tells the status of each")
    print_errors(made)
