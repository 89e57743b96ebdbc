"""Options that commands share, and what they stand for."""

from __future__ import annotations

import dataclasses
import inspect
import sys
from collections.abc import Callable, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from tqdm import tqdm

from jaxsph.cli import ARRANGEMENTS, SCALES, positive_float, positive_int, seed
from jaxsph.scenes import SCENES, Scene
from jaxsph.schemes import SCHEMES

from ..basis import Energy, Euclidean
from ..points import Compressible, Family, Formulation, Solenoidal
from ..study import PLANS, Plan, quiet

PRODUCTS = {"euclidean": Euclidean, "energy": Energy}
CLOSURES = ("none", "linear")
FORMULATIONS = ("compressible", "solenoidal")
KNOWN = tuple(n for n, make in SCENES.items() if "reynolds" in inspect.signature(make).parameters)


def add_training_options(add) -> None:
    """What full runs are made and how they are reduced."""
    add("scene", metavar="SCENE", help=f"one of {', '.join(KNOWN)}")
    add("--train", type=positive_float, nargs="+", metavar="RE",
        help=f"Reynolds numbers to train on ({defaults('train')})")  # fmt: skip
    add("--inner-product", choices=tuple(PRODUCTS), default="energy",
        help="of POD and projection (default: energy; euclidean is the paper's)")  # fmt: skip
    add("--scheme", choices=tuple(SCHEMES), help="of the full model (default: the scene's)")
    add("--scale", choices=SCALES, default="small", help="size of the runs (default: small)")
    add("--resolution", type=positive_int, metavar="N", help="particles per longest side")
    add("--h-over-dx", type=positive_float, metavar="X", help="smoothing length over spacing")
    add("--time-step", type=positive_float, metavar="DT", help="time step [s]")
    add("--t-end", type=positive_float, metavar="T", help="end time [s]")
    add("--settling", type=positive_float, metavar="T",
        help="time a run from rest takes before the studied time begins [s] "
        f"({defaults('settling')}; other scenes start from rest)")  # fmt: skip
    add("--arrangement", choices=tuple(ARRANGEMENTS), help="how particles start (default: the "
        "scene's; for models on reference points stirred where there are no walls)")  # fmt: skip
    add("--seed", type=seed, metavar="N", help="of the arrangement (default: 0)")
    add("--precision", choices=("float32", "float64"), default="float64",
        help="default: %(default)s")  # fmt: skip


def add_closure_options(add, default: str) -> None:
    """How models on reference points are formulated and closed."""
    add("--formulation", choices=FORMULATIONS,
        help="of models on reference points: the compressible equations as they are, or solenoidal "
        "modes with the pressure recovered (default: solenoidal between walls "
        "without a closure)")  # fmt: skip
    add("--closure", choices=CLOSURES, default=default,
        help="of models on reference points (default: %(default)s)")  # fmt: skip
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


def check_scene(options) -> None:
    """A ValueError if there is no such scene."""
    if options.scene not in SCENES:
        raise ValueError(
            f"scene {options.scene!r} is not known; choose one of {', '.join(KNOWN)}."
        )
    if options.scene not in KNOWN:
        raise ValueError(
            f"scene {options.scene} has no Reynolds number; choose one of {', '.join(KNOWN)}, or "
            "train on parameters of its own by jaxsph_rom.train."
        )


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


def scene_maker(
    options,
    plan: Plan,
    reynolds: tuple[float, ...],
    folder: Path,
    on_points: bool,
    check: Callable[[Scene], None] | None = None,
    trained: Callable[[Family], None] | None = None,
) -> Family:
    """The scenes of any Reynolds number; bad input is met before the packing.

    Args:
        options: of the command.
        plan: of the scene.
        reynolds: Reynolds numbers that will be run.
        folder: where runs that settle are kept.
        on_points: whether models on reference points are made of the runs. Flows without walls
            then start from stirred particles at a balanced pressure.
        check: what else must hold of the scene, with its particles on a lattice.
        trained: what must hold of the scenes that are trained on, likewise.
    """
    make = SCENES[options.scene]
    settings = {
        "scale": options.scale,
        "resolution": options.resolution,
        "h_over_dx": options.h_over_dx,
        "time_step": options.time_step,
        "dtype": options.precision,
    }
    if options.scheme is not None:
        settings["scheme"] = SCHEMES[options.scheme]
    if options.t_end is not None:
        settings["end_time"] = options.t_end
    plan.scenes(make, folder, bar)  # refuses to let what starts from rest settle
    started = {} if plan.settling is None else {"start_time": plan.settling}
    lattice = ARRANGEMENTS["lattice"](seed=0)
    plain = partial(make, arrangement=lattice, **started, **settings)
    for number in reynolds:
        cheap = plain(reynolds=number)
        plan.probes(cheap)
    if trained is not None:
        trained(Family(lambda reynolds: plain(reynolds=reynolds)))
    if check is not None:
        check(cheap)
    start_quiet = on_points and cheap.walls is None
    arrangement = options.arrangement or ("stirred" if start_quiet else None)
    if arrangement is not None or options.seed is not None:
        rule = ARRANGEMENTS[arrangement or "packed"]
        settings["arrangement"] = rule(seed=options.seed or 0)
    scene = plan.scenes(partial(make, **settings), folder, bar)
    looked_at = partial(make, **started, **settings)

    def started_quietly(reynolds):
        found = scene(reynolds=reynolds)
        return quiet(found) if start_quiet else found

    return Family(
        started_quietly,
        starts=plan.settling is None,
        probe=None if plan.settling is None else lambda reynolds: looked_at(reynolds=reynolds),
    )


@contextmanager
def bar(label: str, total: int, done: int = 0):
    """A progress bar on stderr; gives the function to report steps to."""
    interval = 0.1 if sys.stderr.isatty() else 10.0  # spare log files
    with tqdm(
        desc=label, total=total, initial=done, unit="step", file=sys.stderr, mininterval=interval
    ) as shown:
        yield shown.update
