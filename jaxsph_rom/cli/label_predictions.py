"""`jaxsph-rom predict FILE` of a model on labels: its particles as files."""

from __future__ import annotations

import sys
from pathlib import Path

import jax
import numpy as np

from jaxsph.cli import fail, print_rows
from jaxsph.cli.options import write_json
from jaxsph.environment import environment
from jaxsph.integrate import explanation
from jaxsph.io import check_target

from ..labels import LabelModel, LabelPrediction, load
from ..labels.label_model import KIND
from .earlier_prediction import MEMBER, MOST_FILES, PREDICTION, remove_earlier
from .options import MOST_BYTES, said, wanted_points, wanted_times
from .predicted import none_left

LABELS = KIND[0]  # the format of their files
_DOUBTS = {
    "labels_mix_from": "its labels mix",
    "samples_miss_particles_from": "its samples meet particles that are not followed",
}


def predict_on_labels(options, folder: Path) -> int:
    """Run it at the parameters of the command; a file for each member that has snapshots."""
    for name, given in (("fields", options.fields), ("tracers", options.tracers is not None)):
        if given:
            raise ValueError(
                f"--{name}: is of models on points; the particles of a model on labels are written "
                "anyway. Leave it out."
            )
    check_target(folder / MEMBER.format(0))
    with jax.enable_x64(True):  # whatever the file holds is kept
        model = load(options.model)
    with jax.enable_x64(model.labels.dtype == np.float64):
        points = wanted_points(options, model.names)
        times = wanted_times(options, model.schedule, model.system.size)
        _check(model, len(points), times)
        prediction = model.predict(dict(zip(model.names, points.T, strict=True)), times=times)
        _warn(model, prediction)
        remove_earlier(folder)
        (folder / PREDICTION).unlink(missing_ok=True)
        doubts = [_written(folder, prediction, k) for k in range(len(prediction))]
    results = _results(options, model, prediction, doubts, folder)
    write_json(options.json, {**results, **environment()})
    _print(results, model, prediction)
    lost = none_left(prediction.status)
    return fail("jaxsph-rom", lost, 1) if lost else 0


def _check(model: LabelModel, count: int, times) -> None:
    """A ValueError for what asks too much."""
    if count > MOST_FILES:
        raise ValueError(
            f"--at: writes the particles of each of {count} members; give at most {MOST_FILES}, "
            "or use `jaxsph_rom.labels.load(FILE).predict` for coordinates alone."
        )
    snapshots = (model.schedule.intervals if times is None else len(times) - 1) + 1
    size = 8 * snapshots * model.labels.size * 3
    if size > MOST_BYTES:
        raise ValueError(
            f"--t-end: {snapshots} snapshots of {len(model.labels)} particles make "
            f"{size / 2**30:.3g} GiB a member; give an earlier end."
        )


def _written(folder: Path, prediction: LabelPrediction, member: int) -> dict[str, float | None]:
    """Write a member; from when on it is not to be believed [s], if it is not."""
    if not prediction.good(member):
        return dict.fromkeys(_DOUBTS)
    run, model = prediction.fields(member), prediction.model
    run.metadata["time_step"] = model.schedule.time_step
    run.metadata["parameters"] = _parameters(prediction, member) | {
        "reduced": {"modes": model.system.size, "labels": len(model.labels), **model.training},
        "outside": bool(prediction.outside[member]),
        "fault": _fault(prediction, member),
    }
    run.save(folder / MEMBER.format(member), overwrite=True)
    found = prediction.mixed_from(member), prediction.strayed_from(member)
    return dict(zip(_DOUBTS, found, strict=True))


def _parameters(prediction: LabelPrediction, member: int) -> dict[str, float]:
    return {name: float(values[member]) for name, values in prediction.parameters.items()}


def _fault(prediction: LabelPrediction, member: int) -> str | None:
    return explanation(prediction.status[member]) if prediction.status[member] else None


def _warn(model: LabelModel, prediction: LabelPrediction) -> None:
    """A line on stderr for what no training run has seen."""
    if count := int(prediction.outside.sum()):
        seen = ", ".join(f"{name} {low:g} to {high:g}" for name, (low, high) in model.range.items())
        print(f"jaxsph-rom: warning: {count} of {len(prediction)} members are outside of the "
              f"training runs, {seen}, up to t = {model.schedule.end_time:g} s.",
              file=sys.stderr)  # fmt: skip


def _results(options, model, prediction, doubts, folder):
    return {
        "model": options.model,
        "scene": model.scene,
        "modes": model.system.size,
        "training": model.training,
        "end_time": prediction.time[-1],
        "run_seconds": prediction.run_seconds,
        "compile_seconds": prediction.compile_seconds,
        "stable": int((prediction.status == 0).sum()),
        "outside": int(prediction.outside.sum()),
        "members": [
            {
                "parameters": _parameters(prediction, k),
                "file": folder / MEMBER.format(k) if prediction.good(k) else None,
                **doubts[k],
                "fault": _fault(prediction, k),
            }
            for k in range(len(prediction))
        ],
    }


def _print(results, model: LabelModel, prediction: LabelPrediction) -> None:
    trained = "; ".join(said(named) for named in model.training["trained_on"])
    print_rows({
        "model": f"{results['scene']}, M = {results['modes']} on {len(model.labels)} labels",
        "trained on": f"{trained}, to t = {model.schedule.end_time:g} s",
        "time": f"to t = {results['end_time']:g} s",
        "run": f"{results['run_seconds']:.3g} s",
        "compile": f"{results['compile_seconds']:.3g} s",
        "stable": f"{results['stable']} of {len(prediction)}",
        "outside": f"{results['outside']} of {len(prediction)}",
    })  # fmt: skip
    for member in results["members"]:
        line = f"  {said(member['parameters'])}: {member['file'] or 'no snapshot'}"
        if member["fault"]:
            line += f", {member['fault']}"
        for name, told in _DOUBTS.items():
            if member[name] is not None:
                line += f", {told} from t = {member[name]:.3g} s on"
        print(line)
