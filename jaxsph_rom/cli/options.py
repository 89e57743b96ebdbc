"""Options that commands share, and what they stand for."""

from __future__ import annotations

import argparse
import dataclasses
import inspect
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import contextmanager
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from jaxsph.cli import ARRANGEMENTS, Parser, positive_float, reynolds_numbers
from jaxsph.cli.options import MOST_NUMBERS
from jaxsph.cli.scene_functions import made, unpacked
from jaxsph.cli.scene_options import add_scene_options, scene_settings
from jaxsph.progress import progress_bar
from jaxsph.scenes import Scene
from jaxsph.schedule import Schedule
from jaxsph_command.errors import meant

from ..basis import Energy, Euclidean
from ..points import Compressible, Family, Formulation, Solenoidal
from ..study import PLANS, Plan, quiet

PRODUCTS = {"euclidean": Euclidean, "energy": Energy}
CLOSURES = ("none", "linear")
MOST_BYTES = 4 * 2**30  # of all coordinates of a prediction
REYNOLDS = {  # as commands read it that train models
    "reynolds": {"help": "Reynolds number of all runs, where models are trained on others of their "
                 "parameters"},
}  # fmt: skip
FORMULATIONS = ("compressible", "solenoidal")


def add_training_options(
    parser: Parser, words: list[str], reynolds: dict[str, Any] = REYNOLDS
) -> None:
    """What full runs are made and how they are reduced; after a command's own options, which the
    scene's settings leave alone. `reynolds` is how that setting of the scene is read."""
    add = parser.add_argument
    add("--train", type=training_values, nargs="+", metavar="RE",
        help=f"Reynolds numbers to train on ({defaults('train')}), or START:STOP:COUNT; or other "
        "parameters of the scene, as NAME=VALUE,VALUE; all combinations are run")  # fmt: skip
    add("--inner-product", choices=tuple(PRODUCTS), default="energy",
        help="of POD and projection (default: energy; euclidean is the paper's)")  # fmt: skip
    add("--settling", type=positive_float, metavar="T",
        help="time a run from rest takes before the studied time begins [s] "
        f"({defaults('settling')}; other scenes start from rest)")  # fmt: skip
    add_scene_options(parser, words, reynolds)
    parser.set_defaults(precision="float64")


def add_closure_options(add, default: str | None) -> None:
    """How models on reference points are formulated and closed."""
    add("--formulation", choices=FORMULATIONS,
        help="of models on reference points: the compressible equations as they are, or solenoidal "
        "modes with the pressure recovered (default: solenoidal between walls "
        "without a closure)")  # fmt: skip
    add("--closure", choices=CLOSURES, default=default,
        help="of models on reference points (default: "
        f"{default or 'none where --hyper is given'})")  # fmt: skip
    add("--held-back", type=positive_float, metavar="RE",
        help="training Reynolds number that only judges the closure (default: an inner one where "
        "there are four or more)")  # fmt: skip


def defaults(name: str) -> str:
    """The defaults of an option, scene by scene."""
    found: dict[str, list[str]] = {}
    for scene, plan in PLANS.items():
        value = getattr(plan, name)
        if value is not None:
            text = " ".join(f"{v:g}" for v in (value if isinstance(value, tuple) else (value,)))
            found.setdefault(text, []).append(scene)
    return "default: " + "; ".join(f"{text} for {', '.join(s)}" for text, s in found.items())


def training_values(text: str) -> tuple[str, tuple[float, ...]]:
    """A parameter's name and values, of Reynolds numbers without the name."""
    return named_numbers(text) if "=" in text else ("reynolds", tuple(reynolds_numbers(text)))


def named_numbers(text: str) -> tuple[str, tuple[float, ...]]:
    """A parameter's name and values."""
    name, equals, values = text.partition("=")
    found: list[float] = []
    for part in values.split(","):
        try:
            if part.count(":") == 2:
                low, high, count = part.split(":")
                if int(count) > MOST_NUMBERS:
                    raise argparse.ArgumentTypeError(f"at most {MOST_NUMBERS} values, got {text}")
                found += np.linspace(float(low), float(high), int(count)).tolist()
            else:
                found.append(float(part))
        except ValueError:
            raise argparse.ArgumentTypeError(f"NAME=VALUE with numbers, got {text!r}") from None
    if not name or not equals or not found or not np.isfinite(found).all():
        raise argparse.ArgumentTypeError(f"NAME=VALUE with finite numbers, got {text!r}")
    return name, tuple(found)


def by_name(given: Iterable[tuple[str, tuple[float, ...]]]) -> dict[str, tuple[float, ...]]:
    """Values of each parameter that is named, each once."""
    found: dict[str, tuple[float, ...]] = {}
    for name, values in given:
        found[name] = distinct((*found.get(name, ()), *values))
    return found


def trained_at(options) -> dict[str, tuple[float, ...]] | None:
    """Values of each parameter to train on, if any are given, which the scene must take."""
    takes = inspect.signature(options.make).parameters
    any_name = any(p.kind is p.VAR_KEYWORD for p in takes.values())
    values = None if options.train is None else by_name(options.train)
    for name in values or {"reynolds": ()}:
        if name not in takes and not any_name:
            raise ValueError(
                f"--train: scene {options.scene} has no {name}{meant(name, takes)}; give others of "
                f"its parameters, as NAME=VALUE,VALUE: it has {', '.join(takes)}."
            )
        if name in settings_given(options):
            raise ValueError(
                f"{name}: is given as a setting, and models are trained over it; give its values "
                f"by --train {name}=VALUE,VALUE, or train on other parameters."
            )
    return values


def settings_given(options) -> tuple[str, ...]:
    """Settings that are the same in all runs, by the scene's names."""
    given = [name for k, name in options.settings.items() if getattr(options, k, None) is not None]
    return (*given, *dict(options.set))


def formulation(options) -> Formulation | None:
    """The formulation asked for, if one is."""
    if options.formulation == "solenoidal":
        return Solenoidal()
    if options.formulation == "compressible":
        return Compressible(PRODUCTS[options.inner_product]())
    return None


def check_closure(options) -> None:
    """A ValueError if a run is held back from no closure."""
    if options.held_back is not None and options.closure == "none":
        raise ValueError("--held-back: without a closure there is nothing to judge; leave it out.")


def planned(options, needed: tuple[str, ...], given: dict[str, Any]) -> Plan:
    """The scene's plan with what is given on the command line.

    Args:
        options: of the command.
        needed: options without which there is no plan for a scene that has none of its own.
        given: values for the plan.
    """
    plan = PLANS.get(options.scene)
    if plan is None:
        missing = [f"--{name}" for name in needed if getattr(options, name) is None]
        if missing:
            raise ValueError(
                f"scene {options.scene} has no plan of its own; give {', '.join(missing)}."
            )
        plan = Plan((), (), (), 1e-4)
    return dataclasses.replace(plan, **given)


def said(parameters: Mapping[str, float]) -> str:
    """Parameters as a line says them."""
    return ", ".join(
        f"Re {value:g}" if name == "reynolds" else f"{name} {value:g}"
        for name, value in parameters.items()
    )


def distinct(values) -> tuple[float, ...]:
    """Values without repetitions, in the order given."""
    return tuple(dict.fromkeys(values))


def combinations(values: dict[str, tuple[float, ...]]) -> list[dict[str, float]]:
    """All combinations, from the largest values on."""
    count = math.prod(map(len, values.values()))
    if count > MOST_NUMBERS:
        raise ValueError(f"--train: {count} combinations; give at most {MOST_NUMBERS} a call.")
    ordered = [sorted(of, reverse=True) for of in values.values()]
    return [dict(zip(values, point, strict=True)) for point in product(*ordered)]


def wanted_points(options, names: Sequence[str]) -> np.ndarray:
    """A row of a model's parameters a member."""
    given = by_name([*(("reynolds", v) for v in options.reynolds or ()), *(options.at or ())])
    if set(given) != set(names):
        wanted = " ".join(f"{name}=..." for name in names)
        raise ValueError(f"--at: give a value of each parameter of the model: --at {wanted}")
    count = math.prod(len(values) for values in given.values())
    if count > MOST_NUMBERS:
        raise ValueError(f"--at: {count} combinations; give at most {MOST_NUMBERS} a call.")
    return np.array(list(product(*(given[name] for name in names))))


def wanted_times(options, schedule: Schedule, modes: int) -> np.ndarray | None:
    """Whole snapshot intervals to the end that is asked for."""
    if options.t_end is None:
        return None
    count = max(1, round(options.t_end / schedule.interval))
    nearest = count * schedule.interval
    if abs(nearest - options.t_end) > 1e-6 * nearest:
        raise ValueError(
            f"--t-end: {options.t_end:g} s is no whole number of snapshot intervals of "
            f"{schedule.interval:g} s; the nearest is {nearest:g} s."
        )
    if count * modes * 8 > MOST_BYTES:
        raise ValueError(f"--t-end: {count} snapshots are too many to keep; give an earlier end.")
    return schedule.interval * np.arange(count + 1)


def scene_maker(
    options,
    plan: Plan,
    points: Sequence[Mapping[str, float]],
    folder: Path,
    on_points: bool,
    check: Callable[[Scene], None] | None = None,
    trained: Callable[[Family], None] | None = None,
) -> Family:
    """The scenes of any parameters; bad input is met before the packing.

    Args:
        options: of the command.
        plan: of the scene.
        points: parameters that will be run.
        folder: where runs that settle are kept.
        on_points: whether models on reference points are made of the runs. Flows without walls
            then start from stirred particles at a balanced pressure.
        check: what else must hold of the scene, with its particles on a lattice.
        trained: what must hold of the scenes that are trained on, likewise.
    """
    make = options.make
    settings = scene_settings(options, make, options.precision)
    settings.pop("arrangement", None)
    plan.scenes(make, folder, bar)  # refuses to let what starts from rest settle
    started = {} if plan.settling is None else {"start_time": plan.settling}
    lattice = unpacked(make)

    def plain(**parameters):
        return made(make, {**settings, **lattice, **started, **parameters})

    for point in points:
        cheap = plain(**point)
        plan.probes(cheap)
    if trained is not None:
        trained(Family(plain))
    if check is not None:
        check(cheap)
    start_quiet = on_points and cheap.walls is None and bool(lattice)
    arrangement = options.arrangement if lattice else None
    arrangement = arrangement or ("stirred" if start_quiet else None)
    if lattice and (arrangement is not None or options.seed is not None):
        rule = ARRANGEMENTS[arrangement or "packed"]
        settings["arrangement"] = rule(seed=options.seed or 0)

    def whole(**named):
        return made(make, {**settings, **named})

    whole.__signature__ = inspect.signature(make)  # by which a plan knows what it can be given
    scene = plan.scenes(whole, folder, bar)

    usual = not any(p.default is p.empty for p in whole.__signature__.parameters.values())

    @cache  # to balance a pressure takes as long as many steps
    def started_quietly(**parameters):
        found = scene(**parameters)
        if not start_quiet:
            return found
        return quiet(found, started_quietly() if usual and parameters else None)

    return Family(
        started_quietly,
        starts=plan.settling is None,
        probe=None if plan.settling is None else lambda **named: whole(**started, **named),
    )


@contextmanager
def bar(label: str, total: int, done: int = 0):
    """A progress bar on stderr; gives the function to report steps to."""
    with progress_bar(total, "step", done, label) as shown:
        yield shown.update
