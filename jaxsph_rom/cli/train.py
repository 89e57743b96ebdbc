"""`jaxsph-rom train SCENE`: full runs in, the file of a reduced model out."""

from __future__ import annotations

import dataclasses
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jax

from jaxsph import Trajectory
from jaxsph.cli import Parser, fail, positive_int, print_rows
from jaxsph.cli.options import (
    add_json_option,
    bytes_in,
    bytes_told,
    result_file,
    write_json,
)
from jaxsph.cli.scene_functions import name_of
from jaxsph.environment import environment
from jaxsph.integrate import SimulationError
from jaxsph.io import check_target
from jaxsph.scenes import Scene
from jaxsph_command.config import NAME, write_config

from ..points import (
    Family,
    LinearClosure,
    Samples,
    Tensors,
    TrainedModel,
    formulation_for,
    train_each,
)
from ..points.training.linear_closure import held_back
from ..points.training.training import check_family
from ..study import Plan, full_run
from .options import (
    PRODUCTS,
    add_closure_options,
    add_training_options,
    bar,
    check_closure,
    combinations,
    formulation,
    planned,
    said,
    scene_maker,
    trained_at,
)

ERRORS_TOLD = (
    "percent discrepancy over the reference points on the training runs, peak and median over time "
    "(in brackets that of the projection, the floor of any model)"
)
REDUCTIONS = {"tensors": Tensors(), "samples": Samples()}


def add_to(parser: Parser, words: list[str]) -> None:
    """Add the command's options to its parser."""
    parser.description = (
        "Run full models, make a reduced model on reference points from them, and "
        "write it to a file from which `jaxsph-rom predict` runs it at any Reynolds number. Full "
        "runs are kept: the same command goes on where it was cut short."
    )
    parser.set_defaults(command=_train)
    add = parser.add_argument
    add("--modes", type=positive_int, default=10, metavar="M",
        help="number of modes (default: %(default)s)")  # fmt: skip
    add("--reduction", choices=tuple(REDUCTIONS), default="tensors",
        help="constant tensors, or rates as they are at a few points, for forces that change with "
        "time (default: %(default)s)")  # fmt: skip
    add_closure_options(add, default="linear")
    add("--closure-iterations", type=positive_int, default=600, metavar="K",
        help="of the closure's training (default: %(default)s)")  # fmt: skip
    add("--runs", type=Path, metavar="DIR",
        help="where full runs are kept (default: --out, or out/train-SCENE)")  # fmt: skip
    add("--out", type=Path, metavar="DIR", help="folder of the model and its "
        "full runs, or a file ending with .h5 (default: out/train-SCENE)")
    add_json_option(parser)
    add_training_options(parser, words)


def _train(options) -> int:
    usual = Path("out", f"train-{name_of(options.scene, options.make)}")
    path = result_file(options.out, options.runs or usual, "model.h5")
    folder = options.runs or (usual if options.out in (None, path) else options.out)
    check_target(path)
    with jax.enable_x64(options.precision == "float64"):
        values = trained_at(options)
        plan = _plan(options, values)
        check_closure(options)
        reduction = REDUCTIONS[options.reduction]
        parameters = combinations(values or {"reynolds": plan.train})
        closure = _closure(options, parameters)

        def check(family: Family) -> None:
            check_family(family, parameters, (options.modes,), closure, reduction)

        try:
            family = scene_maker(options, plan, parameters, folder, True, trained=check)
            scenes = [family.scene(named) for named in parameters]
            names = [None if set(named) == {"reynolds"} else said(named) for named in parameters]
            runs = [
                full_run(folder / "full", scene, bar, name)
                for scene, name in zip(scenes, names, strict=True)
            ]
            made_as = formulation(options)
            if made_as is None:
                product = PRODUCTS[options.inner_product]()
                made_as = formulation_for(scenes[0], product, closed=closure is not None)
            (trained,) = train_each(
                family, parameters, (options.modes,), runs=runs, closure=closure,
                formulation=made_as, reduction=reduction, progress=bar,
            )  # fmt: skip
        except SimulationError as error:
            return fail("jaxsph-rom", f"full model: {error}", 1)
        except KeyboardInterrupt:
            return fail("jaxsph-rom", "interrupted; the same command goes on from here.", 130)
        trained = dataclasses.replace(
            trained,
            training=trained.training
            | {"inner_product": options.inner_product, "full_seconds": _seconds(scenes, runs)},
        )
        trained.save(path)
        write_config(path.with_name(NAME), options)
    write_json(options.json, {**_results(trained, path), **environment()})
    _print(trained, runs[0].particles, path, folder)
    return 0


def _plan(options, values: dict[str, tuple[float, ...]] | None) -> Plan:
    given: dict[str, Any] = {}
    if values is not None:
        given["train"] = values.get("reynolds", ())
    if options.settling is not None:
        given["settling"] = options.settling
    return planned(options, ("train",), given)


def _closure(options, parameters) -> LinearClosure | None:
    if options.closure == "none":
        return None
    judge = held_back(parameters)
    if options.held_back is not None:
        judge = {name: options.held_back for name in parameters[0]}
        if judge not in parameters or len(parameters) < 2:
            known = "; ".join(said(named) for named in reversed(parameters))
            raise ValueError(
                f"--held-back: {said(judge)} must be one of at least two training "
                f"points, which are {known}."
            )
    return LinearClosure(judge, iterations=options.closure_iterations)


def _seconds(scenes: list[Scene], runs: list[Trajectory]) -> float:
    """Run time of all full runs [s], also where a run was taken up again."""
    return sum(
        run.timing.seconds(scene.steps)
        for scene, run in zip(scenes, runs, strict=True)
    )


def _results(trained: TrainedModel, path: Path) -> dict[str, Any]:
    return {
        "scene": trained.scene,
        "parameters": trained.parameters,
        "modes": trained.flow.basis.size,
        "end_time": trained.schedule.end_time,
        **trained.training,
        "model": path,
    }


def _print(trained: TrainedModel, particles: int, path: Path, folder: Path) -> None:
    made = trained.training
    closure = made["closure"]
    if closure != "none":
        judge = made["held_back"]
        closure += f", {made['closure_seconds']:.3g} s"
        closure += "" if judge is None else f", {said(judge)} held back"
    print_rows({
        "scene": f"{trained.scene}, {particles} particles, to t = {trained.schedule.end_time:g} s",
        "trained on": "; ".join(said(named) for named in reversed(made["trained_on"])),
        "modes": f"{trained.flow.basis.size}, {made['inner_product']} inner product, "
        f"{made['formulation']}",
        "full runs": f"{made['full_seconds']:.3g} s",
        "offline": f"{made['offline_seconds']:.3g} s (map, decompose, project)",
        "closure": closure,
        "model": f"{path}, {bytes_told(path.stat().st_size)}",
        "runs kept": f"{bytes_told(bytes_in(folder / 'full'))} in {folder / 'full'}",
    })  # fmt: skip
    print_errors(made)


def print_errors(training: dict[str, Any]) -> None:
    """What a model gets wrong on the runs that it was trained on."""
    print("\n" + "\n".join(textwrap.wrap(f"{ERRORS_TOLD}:", 100)))
    for line in error_lines(training):
        print(f"  {line}")


def error_lines(training: dict[str, Any]) -> Iterator[str]:
    """Of each training run what the model gets wrong."""
    for row in reversed(training["runs"]):
        error, floor = row["errors"], row["floor"]
        if isinstance(error, str):
            yield f"{said(row['parameters'])}: {error}"
            continue
        velocity = _told("velocity", "percent", error, floor)
        if error["pressure_peak_percent"] is None:
            pressure = f"{_told('pressure', 'pascal', error, floor)} Pa, which is uniform"
        else:
            pressure = _told("pressure", "percent", error, floor)
        yield f"{said(row['parameters'])}: {velocity}; {pressure}"


def _told(name: str, unit: str, error: dict[str, float], floor: dict[str, float]) -> str:
    return ", ".join(
        f"{what}{error[key]:.3g} ({floor[key]:.3g})"
        for what, key in ((f"{name} ", f"{name}_peak_{unit}"), ("", f"{name}_median_{unit}"))
    )
