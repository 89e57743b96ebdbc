"""What a prediction came to: as printed, as JSON, and as a page."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from jaxsph.cli import print_rows
from jaxsph.environment import environment
from jaxsph.integrate import explanation
from jaxsph.plotting import snapshot_figure
from jaxsph.plotting.style import png

from ..points import Prediction, TrainedModel
from ..report.figures import expected_errors
from ..report.prediction_report import write_prediction_report
from .options import said
from .train import ERRORS_TOLD, error_lines, print_errors

_FAULTS_KEPT = 100
_FAULTS_SHOWN = 5


def none_left(status: np.ndarray) -> str:
    """What to say where every member of a prediction is lost; else nothing."""
    if not status.all():
        return ""
    count = "the one member is" if len(status) == 1 else f"all {len(status)} members are"
    first = "" if len(status) == 1 else "of the first, "
    return f"{count} lost: {first}{explanation(status[0])}."


def results_of(
    trained: TrainedModel, prediction: Prediction, model: Path, path: Path
) -> dict[str, Any]:
    """What a prediction came to, JSON-like.

    Args:
        trained: what was run.
        prediction: what it gave.
        model, path: the files of both.
    """
    lost = np.flatnonzero(prediction.status)
    return {
        "model": model,
        "scene": trained.scene,
        "modes": trained.flow.basis.size,
        "training": trained.training,
        "members": len(prediction),
        "lowest": dict(zip(prediction.names, prediction.points.min(axis=0), strict=True)),
        "highest": dict(zip(prediction.names, prediction.points.max(axis=0), strict=True)),
        "outside": int(prediction.outside.sum()),
        "start": prediction.start,
        "operators": prediction.operators,
        "error_indicator_percent": _percent(prediction),
        "end_time": prediction.time[-1],
        "steps": (len(prediction.time) - 1) * trained.schedule.steps_per_snapshot,
        "run_seconds": prediction.run_seconds,
        "compile_seconds": prediction.compile_seconds,
        "stable": len(prediction) - len(lost),
        "faults": [
            {
                "parameters": {n: v[k] for n, v in prediction.parameters.items()},
                "step": prediction.step[k],
                "fault": explanation(prediction.status[k]),
            }
            for k in lost[:_FAULTS_KEPT]
        ],
        "prediction": path,
    }


def _percent(prediction: Prediction) -> dict[str, float] | None:
    """Median and largest expected error of members that are not lost."""
    found = 100.0 * prediction.error_indicator[np.isfinite(prediction.error_indicator)]
    if not len(found):
        return None
    return {"median": float(np.median(found)), "largest": float(found.max())}


def _rows(
    results: dict[str, Any], trained: TrainedModel, prediction: Prediction
) -> dict[str, str]:
    count, made, expected = len(prediction), trained.training, results["error_indicator_percent"]
    rows = {
        "model": f"{results['scene']}, M = {results['modes']}, {made['reduction']}, closure "
        f"{made['closure']}",
        "trained on": "; ".join(said(named) for named in reversed(made["trained_on"]))
        + f", to t = {trained.schedule.end_time:g} s",
    }
    for name, values in prediction.parameters.items():
        title = "Reynolds numbers" if name == "reynolds" else name
        low, high, some = values.min(), values.max(), len(np.unique(values))
        rows[title] = f"{some}, {low:g} to {high:g}" if some > 1 else f"{low:g}"
    rows |= {
        "steps": f"{results['steps']}, to t = {results['end_time']:g} s",
        "start": results["start"],
        "run": f"{results['run_seconds']:.3g} s",
        "compile": f"{results['compile_seconds']:.3g} s",
        "stable": f"{results['stable']} of {count}",
        "outside": f"{results['outside']} of {count}",
        "expected error": "unknown" if expected is None else f"{expected['median']:.2g} % of "
        f"velocity in the median, {expected['largest']:.2g} % at most",
        "prediction": str(results["prediction"]),
    }
    return rows


def print_prediction(
    results: dict[str, Any], trained: TrainedModel, prediction: Prediction
) -> None:
    """Print the results, the first faults, and what the model gets wrong on its training runs."""
    print_rows(_rows(results, trained, prediction))
    for fault in results["faults"][:_FAULTS_SHOWN]:
        print(f"  {said(fault['parameters'])}, step {fault['step']}: {fault['fault']}")
    if len(results["faults"]) > _FAULTS_SHOWN:
        print("  and more; prediction.h5 tells the status of each")
    print_errors(trained.training)


def write_report(
    folder: Path,
    results: dict[str, Any],
    trained: TrainedModel,
    prediction: Prediction,
    command: str,
) -> Path:
    """Write `report.json` and `report.html`; the path of the page."""
    return write_prediction_report(
        folder,
        results,
        _rows(results, trained, prediction),
        _members(prediction),
        [f"{ERRORS_TOLD}:", *error_lines(trained.training)],
        _figures(trained, prediction),
        environment(),
        command,
    )


def _members(prediction: Prediction) -> tuple[list[str], list[list[str]]]:
    """Columns of a table of the members, and the cells of each."""
    columns = [*prediction.names, "outside", "expected error of velocity [%]", "ended"]
    percent = 100.0 * np.asarray(prediction.error_indicator)
    lines = [
        [
            *(f"{value:.6g}" for value in point),
            "yes" if outside else "no",
            f"{error:.2g}" if np.isfinite(error) else "unknown",
            "whole" if status == 0 else f"at step {step}",
        ]
        for point, outside, error, status, step in zip(
            prediction.points, prediction.outside, percent, prediction.status, prediction.step,
            strict=True,
        )
    ]  # fmt: skip
    return columns, lines


def _figures(trained: TrainedModel, prediction: Prediction) -> list[tuple[bytes, str]]:
    """The last fields of the first run, and expected errors where one parameter was swept."""
    shown = []
    if last := prediction.good(0):
        coordinates, time = prediction.coordinates[0, last - 1 : last], prediction.time[last - 1]
        fluid = trained.fluid(prediction.values[0])
        fields = trained.flow.fields(coordinates, np.array([time]), fluid=fluid)
        walls, box = trained.functional.walls, trained.flow.reference.space.box
        places = None if walls is None else np.asarray(walls.fixed_position)
        named = said({n: float(v[0]) for n, v in prediction.parameters.items()})
        caption = f"Velocity norm and pressure at the reference points, {named}, t = {time:g} s."
        drawn = snapshot_figure(float(time), fields.snapshot(0), walls=places, box=box)
        shown.append((png(drawn), caption))
    percent = 100.0 * np.asarray(prediction.error_indicator)
    if len(prediction.names) == 1 and len(prediction) > 1 and np.isfinite(percent).any():
        (name,), values = prediction.names, prediction.points[:, 0]
        drawn = expected_errors(name, values, percent, trained.points[:, 0])
        shown.append((png(drawn), "Expected error of each run; shaded is what was trained on."))
    return shown
