"""The report of a study: figures, `report.json` and `report.html`."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from jaxsph.environment import environment

from ..basis import cumulative_energy
from ..report import (
    Case,
    Profile,
    Shown,
    best,
    centre_line_profiles,
    discrepancy_history,
    field_differences,
    field_snapshots,
    modes,
    singular_values,
    verdict,
    write_html_report,
    write_report,
)
from .full_runs import FullRuns
from .method import Experiment, ModelBasis
from .study import Outcome, Study

MODEL = "model.h5"  # the file of a model on points, beside the report
_LABELS = {"galerkin": "Galerkin", "apg": "Petrov-Galerkin"}
_SHOWN_MODES = (1, 5, 10)
_SETTINGS = ("advection", "map", "interpolation", "spline_order", "judged_from")
_WRITTEN = (
    "singular_values*.png", "modes*.png", "fields_re_*.png", "differences_re_*.png",
    "discrepancy.png", "centre_line.png",
    MODEL,
)  # fmt: skip
_LISTED_MODES = (2, 5, 10, 20, 30)


def write_study(
    study: Study,
    experiments: Sequence[Experiment],
    outcomes: Sequence[Outcome],
    folder: Path,
    profile_time: float | None = None,
    command: str | None = None,
) -> dict[str, Any]:
    """Write the figures of a study, `report.json`, `report.html` and `model.h5` into a folder.

    The model is that on reference points which errs least, if there is one. Figures and a model of
    an earlier study in the folder are removed.

    Args:
        study: made the runs.
        experiments: each with a basis of its own; the figures of bases are numbered if there are
            several.
        outcomes: of all experiments.
        folder: where all of them go.
        profile_time: at which profiles and fields are shown [s]; half the run if none is given.
        command: that made the study, if one did.

    Returns:
        what the report holds beside its cases.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for pattern in _WRITTEN:
        for earlier in folder.glob(pattern):
            earlier.unlink()
    bases: list[dict[str, Any]] = []
    basis_figures: list[Shown] = []
    shown_of = [outcome for e in experiments for outcome in _largest(e, outcomes)]
    settings: dict[str, Any] = {}
    for number, outcome in enumerate(shown_of):
        suffix = f"_{number + 1}" if len(shown_of) > 1 else ""
        model, case = outcome.made_of(), outcome.case
        basis_figures += _basis_figures(study.runs, case, model, folder, suffix)
        bases.append(_basis_energies(case, model))
        settings |= model.settings
    first = study.runs.scene(experiments[0].trained_on[0])
    if profile_time is None:
        profile_time = 0.5 * first.end_time
    extra = {
        "bases": bases,
        "parameters": first.parameters,
        "map": ", ".join(dict.fromkeys(basis["map"] for basis in bases)),
        "judged_from": study.judged_from,
        "verdict": verdict([outcome.case for outcome in outcomes]),
        **settings,
    }
    history = discrepancy_history(
        [(_name(o), o.time, o.velocity_percent, o.pressure_percent) for o in outcomes],
        folder / "discrepancy.png",
        [o.floor for o in outcomes],
    )
    profiles = _profiles(study.runs, outcomes, folder / "centre_line.png", profile_time)
    caption = "Relative discrepancy of each reduced run from its full model over time"
    if any(outcome.floor is not None for outcome in outcomes):
        caption += ", dotted that of the full run in the same basis, a floor of its models"
    shown = [
        (history, f"{caption}."),
        (profiles, "Velocity norm and pressure on the line that runs are compared on."),
    ]
    if first.space.box.dim == 2:
        shown += _fields(study.runs, outcomes, folder, profile_time)
    cases, made_on = [outcome.case for outcome in outcomes], environment()
    write_report(folder / "report.json", cases, made_on, extra)
    told = {**first.parameters, **{name: extra[name] for name in _SETTINGS if name in extra}}
    told.pop("reynolds", None)  # each case has its own
    write_html_report(folder / "report.html", cases, shown + basis_figures, told, made_on, command)
    on_points = [outcome for outcome in outcomes if outcome.model is not None]
    if on_points:
        chosen = best([outcome.case for outcome in on_points])[0]
        model = next(o.model for o in on_points if o.case is chosen)
        made = model.training | {"inner_product": chosen.inner_product}
        dataclasses.replace(model, training=made).save(folder / MODEL)
    return extra


def _largest(experiment: Experiment, outcomes: Sequence[Outcome]) -> list[Outcome]:
    """Of each kind of an experiment's models one with the most modes."""
    found: dict[str, Outcome] = {}
    for outcome in outcomes:
        case = outcome.case
        if tuple(case.trained_on) != tuple(experiment.trained_on):
            continue
        if case.hyper not in found or found[case.hyper].case.modes < case.modes:
            found[case.hyper] = outcome
    return list(found.values())


def _basis_figures(
    runs: FullRuns, case: Case, model: ModelBasis, folder: Path, suffix: str
) -> list[Shown]:
    """Singular values and modes of a model's basis."""
    basis, lagrangian = model.basis, model.lagrangian
    trained = "" if case.hyper == "none" else f"of {case.hyper}, "
    trained += f"trained on Re {', '.join(f'{number:g}' for number in case.trained_on)}"
    decay = singular_values(
        lagrangian.singular_values, basis.singular_values, folder / f"singular_values{suffix}.png"
    )
    figures = [(decay, f"Singular values and cumulative energy of the basis {trained}.")]
    numbers = tuple(n for n in _SHOWN_MODES if n <= basis.size)
    points = np.asarray(model.reference.points)
    start = runs.full(case.trained_on[0]).position[0]
    if points.shape[1] == 2:
        shown = slice(max(numbers))
        shapes = modes(
            [
                ("Lagrangian space", start, lagrangian.modes[:, :, shown]),
                ("reference space", points, basis.modes[:, :, shown]),
            ],
            numbers,
            folder / f"modes{suffix}.png",
        )
        figures.append((shapes, f"Modes of the basis {trained}."))
    return figures


def _basis_energies(case: Case, model: ModelBasis) -> dict[str, Any]:
    """The cumulative energies of a model's basis [%]."""
    return {
        "trained_on": list(case.trained_on),
        "model": "moving particles" if case.hyper == "none" else case.hyper,
        "map": type(model.reference.map).__name__,
        "cumulative_energy_percent": {
            "reference": _listed(model.basis.singular_values),
            "lagrangian": _listed(model.lagrangian.singular_values),
        },
    }


def _listed(sigma: np.ndarray) -> dict[str, float]:
    energy = cumulative_energy(sigma)
    return {str(m): float(energy[m - 1]) for m in _LISTED_MODES if m <= len(energy)}


def _name(outcome: Outcome) -> str:
    case = outcome.case
    return f"Re {case.reynolds:g}, {_label(case)}, M = {case.modes}"


def _label(case: Case) -> str:
    label = _LABELS[case.projection]
    return label if case.hyper == "none" else f"{label} ({case.hyper})"


def _by_reynolds(outcomes: Sequence[Outcome]) -> dict[float, list[Outcome]]:
    grouped: dict[float, list[Outcome]] = {}
    for outcome in outcomes:
        grouped.setdefault(outcome.case.reynolds, []).append(outcome)
    return grouped


def _profiles(runs: FullRuns, outcomes: Sequence[Outcome], path: Path, time: float) -> Path:
    profiles = []
    several = len({o.case.modes for o in outcomes}) > 1
    for reynolds, group in _by_reynolds(outcomes).items():
        scene, full = runs.scene(reynolds), runs.full(reynolds)
        k = full.nearest(time)
        line = runs.probes(reynolds)
        speed, pressure = runs.profile(reynolds)
        curves = {"full": (speed[k], pressure[k])}
        for outcome in group:
            if outcome.time[-1] < full.time[k]:
                continue  # the run failed before
            row = outcome.trajectory.nearest(full.time[k])
            label = _label(outcome.case)
            label += f", M = {outcome.case.modes}" if several else ""
            curves[label] = (outcome.profile[0][row], outcome.profile[1][row])
        if scene.exact is not None:
            velocity, pressure = scene.exact(line, float(full.time[k]))
            curves["analytic"] = (np.linalg.norm(velocity, axis=1), np.asarray(pressure))
        profiles.append(Profile(reynolds, line[:, 1], curves, time=float(full.time[k])))
    return centre_line_profiles(profiles, path)


def _fields(runs: FullRuns, outcomes: Sequence[Outcome], folder: Path, time: float) -> list[Shown]:
    shown = []
    for reynolds, group in _by_reynolds(outcomes).items():
        full = runs.full(reynolds)
        k = full.nearest(time)
        rows = [_row(f"full, Re {reynolds:g}", full, k)]
        for outcome in group:
            if outcome.time[-1] >= full.time[k]:
                label = f"{_label(outcome.case)}, M = {outcome.case.modes}"
                row = outcome.trajectory.nearest(full.time[k])
                rows.append(_row(label, outcome.trajectory, row))
        scene = runs.scene(reynolds)
        walls = None if scene.walls is None else np.asarray(scene.walls.fixed_position)
        around = {"walls": walls, "box": scene.space.box}
        file = field_snapshots(rows, folder / f"fields_re_{reynolds:g}.png", **around)
        caption = f"Velocity norm and pressure at Re {reynolds:g}, t = {full.time[k]:.4g} s."
        shown.append((file, caption))
        if len(rows) > 1:
            file = field_differences(rows, folder / f"differences_re_{reynolds:g}.png", **around)
            caption = f"Reduced minus full at Re {reynolds:g}, t = {full.time[k]:.4g} s."
            shown.append((file, caption))
    return shown


def _row(label, trajectory, k):
    speed = np.linalg.norm(trajectory.velocity[k], axis=1)
    return label, trajectory.position[k], speed, trajectory.pressure[k]
