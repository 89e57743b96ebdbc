"""From scenes to a reduced model on labels."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from jaxsph import Schedule, Trajectory, run_scene
from jaxsph.scenes import Scene

from ..basis.low_pass import least_snapshots, low_pass
from ..points.dynamics.energy_bound import EnergyBound
from ..points.dynamics.sampling import Sampling
from ..points.parameters.family import Family, refuse_unlike, table
from ..points.parameters.laws import Between, Law
from ..still_walls import check_same_particles
from .displacement import label_snapshots
from .inputs import Inputs
from .label_basis import LabelBasis
from .label_model import LabelModel
from .learning import SNAPSHOTS, STEPS, LabelRun, error_on, learn
from .mixing import MIXED, mixed_from
from .sampling import check_sampling, sample

_SOUND = 0.5  # of the slowest sound's frequency: what is above is filtered out
_NYQUIST = 0.9  # of it, at most
_BEYOND = 4.0  # times the largest coordinates of a training run: a run that is lost
_SPREAD = 0.25  # of a parameter: how far probes go where there is one training value


def train(
    make: Callable[..., Scene] | Family,
    parameters: Sequence[Mapping[str, Any]],
    modes: int = 4,
    *,
    runs: Sequence[Trajectory] | None = None,
    recovered: int = 12,
    sampling: Sampling | None = None,
) -> LabelModel:
    """Run the full model at the training points, and learn a reduced model on labels from these.

    Snapshots are low-passed below the slowest sound of the depth H under a free surface,
    c0 / (4 H), decomposed over labels (`LabelBasis`), and the first M coordinates of motion learn
    their rates (`learn`). Their start is that of the scene that `make` gives.

    Args:
        make: a scene of named parameters; its particles start in the same places for all.
        parameters: the training points.
        modes: M, coordinates that have rates.
        runs: full runs of the scenes, if they are there already.
        recovered: modes of motion that fields are made of, M at least, and of density.
        sampling: particles at which the full functional is evaluated as they move
            (`SampledSystem`); without it rates are learnt (`CubicSystem`).

    Raises:
        ValueError: if scenes differ in their particles' places or in what no reduced model can
            follow, runs are not those of the scenes, labels mix in one of them (it is named), no
            system of so many modes or by these samples stays bounded on the runs, or there can be
            no such samples.
        SimulationError: if a full run fails.

    Examples:
        >>> import jaxsph, jaxsph_rom
        >>> from functools import partial
        >>> make = partial(jaxsph.scenes.standing_wave, 16, end_time=4.0, time_step=0.02)
        >>> points = [{"amplitude": a, "reynolds": 500.0} for a in (0.03, 0.06)]
        >>> trained = jaxsph_rom.labels.train(make, points, modes=2, recovered=4)
        >>> prediction = trained.predict({"amplitude": 0.05, "reynolds": 500.0})
        >>> prediction.fields(0).position.shape  # times, particles, directions
        (11, 128, 2)
    """
    for name, value in (("modes", modes), ("recovered", recovered)):
        if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 1:
            raise ValueError(f"{name}: a number from 1 on, got {value!r}.")
    family = make if isinstance(make, Family) else Family(make)
    names, points = table(parameters)
    named = [dict(zip(names, map(float, point), strict=True)) for point in points]
    scenes = training_scenes(family, named, modes, sampling)
    first = scenes[0]
    if runs is None:
        runs = [run_scene(scene, measure=None) for scene in scenes]
    _check_runs(scenes, runs, named)
    before = clock.perf_counter()
    functionals = [scene.functional() for scene in scenes]
    place = jnp.mean(first.state.position, axis=0)
    inputs = Inputs.between(functionals, place, first.end_time)
    values = np.stack([np.asarray(inputs.coefficients.values(f)) for f in functionals])
    quiet = [_quiet(first, run) for run in runs]
    motion = LabelBasis.of(np.concatenate([q[0] for q in quiet]), 2, max(modes, recovered))
    density = LabelBasis.of(np.concatenate([q[1] for q in quiet]), 1, recovered)
    if motion.size < modes:
        raise ValueError(
            f"modes: {modes} asked for, but the runs give {motion.size}; ask for fewer, or record "
            "more snapshots."
        )
    projected = []
    for scene, theta, (moved, dense) in zip(scenes, values, quiet, strict=True):
        coordinates = motion.project(moved)
        others = np.concatenate([coordinates[:, modes:], density.project(dense)], axis=1)
        start = _start(scene, motion, modes)
        projected.append(LabelRun(theta, start, coordinates[:, :modes], others))
    interval, place = first.schedule.interval, np.asarray(first.state.position)
    if sampling is None:
        learnt = learn(projected, inputs, interval)
        system, told = learnt.system, learnt.told()
    else:
        models = [s.model() for s in scenes]
        system = sample(sampling, models, projected, place, motion, density, inputs, interval)
        told = {"members": len(system.labels), "error": error_on(system, projected, interval)}
        if not np.isfinite(told["error"]):
            raise ValueError(
                "sampling: the model is lost on its own training runs; take fewer recovered modes, "
                "more samples, or more runs."
            )
    probed, known, starts = _probed(family, scenes, names, points, inputs, motion, modes)
    largest = np.abs(np.concatenate([p.coordinates for p in projected])).max(axis=0)
    told |= {
        "trained_on": named,
        "full_seconds": [r.metadata.get("run_seconds") for r in runs],
        "offline_seconds": clock.perf_counter() - before,
    }
    steps = Schedule(interval / STEPS, STEPS, first.schedule.intervals)
    return LabelModel(
        motion, density, system, _bound(largest), place, names,
        points, _law(probed, known, points), _law(probed, starts, points, np.abs(starts).max()),
        first.space, steps, first.name, told,
    )  # fmt: skip


def training_scenes(
    make: Callable[..., Scene] | Family,
    parameters: Sequence[Mapping[str, float]],
    modes: int = 4,
    sampling: Sampling | None = None,
) -> list[Scene]:
    """The scenes of training points, where `train` would not refuse them for what they are.

    Raises:
        ValueError: as `train`, of scenes, samples, and numbers of snapshots and of modes.
    """
    if not parameters or not parameters[0]:
        raise ValueError("parameters: name at least one, as {'amplitude': 0.05}.")
    family = make if isinstance(make, Family) else Family(make)
    scenes = [family.scene(one) for one in parameters]
    first = scenes[0]
    for one, scene in zip(parameters, scenes, strict=True):
        _refuse(first, scene, one)
    if sampling is not None:
        check_sampling(sampling, first)
    found = first.schedule.intervals + 1
    needed = SNAPSHOTS if _cutoff(first) is None else max(SNAPSHOTS, least_snapshots())
    if found < needed:
        raise ValueError(
            f"t-end: gives {found} snapshots, and a model on labels needs {needed}; record more "
            "often, or end later."
        )
    if modes > found * len(scenes):
        raise ValueError(
            f"modes: {modes} asked for, more than the {found * len(scenes)} snapshots there will "
            "be; ask for fewer, or record more."
        )
    return scenes


def _refuse(first: Scene, scene: Scene, parameters: Mapping[str, float], run: bool = True) -> None:
    check_same_particles(scene)
    refuse_unlike(first, scene, parameters, run)
    if not np.array_equal(first.state.position, scene.state.position):
        said = ", ".join(f"{name} = {value:g}" for name, value in parameters.items())
        raise ValueError(
            f"make: particles of the scene of {said} start in other places than the first's; "
            "labels are these places, so make scenes that differ in velocity or forces."
        )


def _check_runs(scenes, runs, named) -> None:
    if len(runs) != len(scenes):
        raise ValueError(f"runs: {len(runs)} for {len(scenes)} training points; give one for each.")
    for scene, run, one in zip(scenes, runs, named, strict=True):
        check_run(scene, run, one)


def check_run(scene: Scene, run: Trajectory, parameters: Mapping[str, float]) -> None:
    """Raise a ValueError if a full run is none of its scene, or labels mix in it."""
    said = ", ".join(f"{name} = {value:g}" for name, value in parameters.items())
    times = scene.schedule.times
    alike = len(run.time) == len(times) and np.allclose(run.time, times, rtol=1e-6)
    if not alike or not np.allclose(run.velocity[0], scene.state.velocity, atol=1e-6):
        raise ValueError(f"runs: the one of {said} is none of its scene; run it anew.")
    mixed = mixed_from(run, scene.space)
    if mixed is not None:
        raise ValueError(
            f"runs: labels mix in the run of {said}: from {mixed:.3g} s on, more than "
            f"{100.0 * MIXED:g} % of neighbours have parted. End the runs before, or make "
            "gentler ones."
        )


def _quiet(scene: Scene, run: Trajectory):
    """Motion and density of a run without sound, where snapshots are often enough to tell it."""
    parts, cutoff = label_snapshots(run, scene.space.box), _cutoff(scene)
    if cutoff is None:
        return parts
    return tuple(low_pass(part.T[:, None, :], run.time, cutoff)[:, 0].T for part in parts)


def _cutoff(scene: Scene) -> float | None:
    """Below the slowest sound [Hz]; None where snapshots are too rare to tell it."""
    height = float(np.ptp(np.asarray(scene.state.position)[:, -1])) + scene.space.spacing
    cutoff = _SOUND * float(scene.fluid.sound_speed) / (4.0 * height)
    return None if cutoff * scene.schedule.interval > 0.5 * _NYQUIST else cutoff


def _start(scene: Scene, motion: LabelBasis, modes: int) -> Float[np.ndarray, " modes"]:
    velocity = np.asarray(scene.state.velocity).reshape(-1)
    return motion.project(np.concatenate([np.zeros_like(velocity), velocity]))[:modes]


def _probed(family, scenes, names, points, inputs, motion, modes):
    """Points of the training scenes and of probes between them, theta and starts there."""
    count = len(names)
    needed = 3 + (count + 1) * (count + 2) // 2 - len(points)
    low, high = points.min(axis=0), points.max(axis=0)
    width = np.where(high > low, high - low, _SPREAD * np.abs(low))
    found, all_points = list(scenes), list(points)
    draw = np.random.default_rng(0).uniform(0.05, 0.95, (max(needed, 0), count))
    for point in low + width * draw:
        one = dict(zip(names, map(float, point), strict=True))
        try:
            scene = family.scene(one, probe=True)
            _refuse(scenes[0], scene, one, run=False)
        except ValueError:  # of a scene that nobody has asked for
            continue
        found.append(scene)
        all_points.append(point)
    values = [np.asarray(inputs.coefficients.values(s.functional())) for s in found]
    starts = [_start(scene, motion, modes) for scene in found]
    return np.stack(all_points), np.stack(values), np.stack(starts)


def _law(probed, found, points, scale: float | None = None) -> Law | Between:
    law = Law.find(probed, found, None if scale is None else np.full(found.shape[1], scale))
    return Between.of(points, found[: len(points)]) if law is None else law


def _bound(largest: Float[np.ndarray, " modes"]) -> EnergyBound:
    """sum of (a / a_max)^2 at most 16 M."""
    zero, dtype = np.zeros(len(largest)), largest.dtype
    parts = (0.0, zero, np.diag(1.0 / largest**2), _BEYOND**2 * len(largest))
    return EnergyBound(*(jnp.asarray(part, dtype) for part in parts))
