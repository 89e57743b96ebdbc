"""`jaxsph-rom predict FILE`: a reduced model at any number of Reynolds numbers."""

from __future__ import annotations

import sys
from pathlib import Path

import jax
import numpy as np

from jaxsph.cli import (
    Parser,
    fail,
    positive_float,
    positive_int,
    reynolds_numbers,
    seed,
)
from jaxsph.cli.options import add_json_option, write_json
from jaxsph.cli.show_contents import file_format
from jaxsph.environment import environment
from jaxsph.integrate import SimulationError
from jaxsph.io import check_target
from jaxsph_command.config import repeating

from ..points import Prediction, TrainedModel, load, save_prediction
from ..points.files.member_files import write_fields, write_tracers
from .earlier_prediction import MEMBER, MOST_FILES, PREDICTION, remove_earlier
from .label_predictions import LABELS, predict_on_labels
from .options import MOST_BYTES, bar, named_numbers, said, wanted_points, wanted_times
from .predicted import none_left, print_prediction, results_of, write_report


def add_to(parser: Parser, words: list[str]) -> None:
    """Add the command's options to its parser."""
    parser.description = (
        "Run a model that `jaxsph-rom train` or `jaxsph_rom.train` made at any number "
        "of parameters at once, and write their coordinates over time to DIR/prediction.h5, "
        "with a page that tells of them, DIR/report.html, and its numbers, report.json. Those of "
        "an earlier prediction in DIR are removed, with its fields and tracers. Of a model that "
        "`jaxsph-rom labels` made, write each member's particles to DIR/member-NNN.h5."
    )
    parser.set_defaults(command=_predict)
    add = parser.add_argument
    add("model", type=Path, metavar="FILE", help="of the model")
    add("--reynolds", type=reynolds_numbers, nargs="+", metavar="RE",
        help="Reynolds numbers, or START:STOP:COUNT for COUNT of them, evenly spaced")  # fmt: skip
    add("--at", type=named_numbers, nargs="+", metavar="NAME=VALUE",
        help="parameters of the model by name, each a number, several with commas between them, or "
        "START:STOP:COUNT; all combinations are run")  # fmt: skip
    add("--t-end", type=positive_float, metavar="T",
        help="end time [s] (default: that of the training runs)")  # fmt: skip
    add("--fields", action="store_true",
        help="of a model on points, write fields at the reference points to DIR/fields "
        f"(up to {MOST_FILES} runs)")  # fmt: skip
    add("--tracers", type=positive_int, metavar="N",
        help="of a model on points, write N particles carried by the flow to DIR/tracers; they "
        "start at reference points drawn by --seed, at each of them if N is larger (up to "
        f"{MOST_FILES} runs)")  # fmt: skip
    add("--seed", type=seed, default=0, metavar="N", help="of the draw (default: 0)")
    add("--out", type=Path, metavar="DIR", help="folder for results (default: out/predict-MODEL)")
    add_json_option(parser)


def _predict(options) -> int:
    folder = options.out or Path("out", f"predict-{options.model.stem}")
    path = folder / PREDICTION
    if file_format(options.model) == LABELS:
        return predict_on_labels(options, folder)
    check_target(path)
    with jax.enable_x64(True):  # whatever the file holds is kept
        trained = load(options.model)
    with jax.enable_x64(trained.flow.reference.points.dtype == np.float64):
        points = wanted_points(options, trained.names)
        times = wanted_times(options, trained.schedule, trained.flow.basis.size)
        _check(options, trained, points, times)
        with bar(f"M = {trained.flow.basis.size}", len(points)) as report:
            prediction = trained.predict(
                dict(zip(trained.names, points.T, strict=True)), times=times, progress=report
            )
        _warn(trained, prediction)
        remove_earlier(folder)
        save_prediction(path, prediction, options.model.name)
        lost = _write_members(options, trained, prediction, folder)
    results = results_of(trained, prediction, options.model, path)
    write_json(options.json, {**results, **environment()})
    page = write_report(folder, results, trained, prediction, repeating(options))
    print_prediction(results, trained, prediction)
    print(f"\nreport: {page}, {page.with_suffix('.json')}")
    lost = none_left(prediction.status) or lost
    return fail("jaxsph-rom", lost, 1) if lost else 0


def _check(options, trained: TrainedModel, points, times) -> None:
    """A ValueError for what asks too much."""
    count, snapshots = len(points), trained.schedule.intervals if times is None else len(times) - 1
    size = count * (snapshots + 1) * trained.flow.basis.size * points.itemsize
    if size > MOST_BYTES:
        raise ValueError(
            f"--at: {count} members over {snapshots} snapshots make {size / 2**30:.3g} GiB; "
            "give fewer or an earlier --t-end."
        )
    for name in ("fields", "tracers"):
        if getattr(options, name) and count > MOST_FILES:
            raise ValueError(
                f"--{name}: writes a file for each of {count} members; give at most "
                f"{MOST_FILES}, or make fields by `Prediction.fields`."
            )


def _warn(trained: TrainedModel, prediction: Prediction) -> None:
    """A line each on stderr for what no training run has seen, and for what is not the family's."""
    beyond = trained.predicted_beyond(prediction)
    for name, count in beyond.items():
        low, high = trained.range[name]
        print(f"jaxsph-rom: warning: {count} of {len(prediction)} {_title(name)} are outside "
              f"those trained on, {low:g} to {high:g}.", file=sys.stderr)  # fmt: skip
    if prediction.time[-1] > trained.schedule.end_time * (1.0 + 1e-6):
        print(f"jaxsph-rom: warning: t = {prediction.time[-1]:g} s is beyond the training "
              f"runs, which end at {trained.schedule.end_time:g} s.", file=sys.stderr)  # fmt: skip
    if prediction.operators == "interpolated":
        print("jaxsph-rom: warning: the operators at these parameters are interpolated between "
              "the training runs.", file=sys.stderr)  # fmt: skip


def _title(name: str) -> str:
    return "Reynolds numbers" if name == "reynolds" else f"values of {name}"


def _said(prediction: Prediction, member: int) -> str:
    return said(dict(zip(prediction.names, map(float, prediction.points[member]), strict=True)))


def _names(prediction: Prediction) -> list[str]:
    """Files of the members."""
    if prediction.names == ("reynolds",):
        return [f"re-{number:.12g}.h5" for number in prediction.points[:, 0]]
    return [MEMBER.format(k) for k in range(len(prediction))]


def _write_members(options, trained: TrainedModel, prediction: Prediction, folder: Path) -> str:
    """Files of single members; what went wrong with tracers, or nothing."""
    names = _names(prediction)
    for member, name in enumerate(names if options.fields else ()):
        write_fields(folder / "fields" / name, trained, prediction, member)
    if options.tracers is None:
        return ""
    points = np.asarray(trained.flow.reference.points)
    count = min(options.tracers, len(points))
    drawn = np.random.default_rng(options.seed).choice(len(points), count, replace=False)
    steps = (len(prediction.time) - 1) * trained.schedule.steps_per_snapshot
    lost = ""
    for member, name in enumerate(names):
        label = f"tracers, {_said(prediction, member)}"
        try:
            with bar(label, steps) as report:
                target = folder / "tracers" / name
                write_tracers(target, trained, prediction, member, points[np.sort(drawn)], report)
        except SimulationError as error:
            lost = lost or f"{label}: {error}"
    return lost
