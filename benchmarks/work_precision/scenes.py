"""Scenes of a setting, what their errors are taken against, and how users run them."""

from __future__ import annotations

import dataclasses
import math
from functools import cache, partial

import jax
import jax.numpy as jnp
import numpy as np

from jaxsph import Trajectory, kernels
from jaxsph.arrangements import Lattice, Packed, Stirred
from jaxsph.effects import DensityDiffusion, ParticleShifting, ShiftingTransport
from jaxsph.interpolation import MovingLeastSquaresMap
from jaxsph.metrics import probe
from jaxsph.scenes import SCENES, Scene
from jaxsph.schemes import SCHEMES
from jaxsph_rom.study import quiet

from ..references.lid_driven_cavity import CavityFlow, regularised_lid, solve
from .settings import MOVING, SAMPLED, TENSOR, Case, FullSetting, ReducedSetting, Setting

STARTS = {"quiet": Stirred, "packed": Packed, "rest": Lattice}
_MANY = 100_000  # steps, enough for any setting's limit
_MOST_JUDGED = 50  # snapshots, evenly spread over the time that counts


def make_scene(name: str, case: Case, setting: FullSetting, reynolds: float) -> Scene:
    """The scene of a setting, its step the largest that divides the run and is within `step`."""
    given = {
        "resolution": setting.resolution,
        "reynolds": reynolds,
        "h_over_dx": setting.h_over_dx,
        "end_time": case.end_time,
        "kernel": getattr(kernels, setting.kernel)(),
        "mach": setting.mach,
        "dtype": setting.precision,
        "scheme": SCHEMES[setting.scheme],
    }
    cheap = SCENES[name](arrangement=Lattice(), time_step=case.end_time / _MANY, **given)
    interval = setting.step * cheap.stable_time_step * cheap.steps_per_snapshot
    steps = cheap.steps_per_snapshot * math.ceil(case.end_time / interval - 1e-9)
    scene = SCENES[name](
        arrangement=STARTS[setting.start](), time_step=case.end_time / steps, **given
    )
    if setting.scheme == "delta-plus":
        effects = tuple(_effects(scene, setting))  # numerical ones differ, the flow does not
        scene = dataclasses.replace(scene, effects=effects, solution=scene.exact)
    return quiet(scene) if setting.start == "quiet" else scene


def _effects(scene: Scene, setting: FullSetting):
    for effect in scene.effects:
        if isinstance(effect, DensityDiffusion):
            if setting.delta > 0.0:
                yield DensityDiffusion(jnp.asarray(setting.delta, effect.delta.dtype))
        elif setting.shifting or not isinstance(effect, ParticleShifting | ShiftingTransport):
            yield effect


def errors(case: Case, scene: Scene, trajectory: Trajectory) -> dict[str, float]:
    """Relative L2 errors over particles or points, in percent, their peak and median over time:

        100 || u - u_ref || / || u_ref ||,    100 || p - p_ref || / || p_ref ||,

    both pressures less their mean over the particles; where the exact field is zero throughout,
    relative to the speed U of the fluid and to rho0 U^2. Times are those from `judged_from` on, the
    start apart; the reference is taken where the particles are. Where it is steady, the pressure is
    the mean over these times instead, without sound: particles are mapped to where they started.
    """
    density = float(scene.fluid.reference_density)
    counted = np.flatnonzero((trajectory.time > 0.0) & (trajectory.time > case.judged_from))
    counted = counted[np.unique(np.linspace(0, len(counted) - 1, _MOST_JUDGED).round().astype(int))]
    run = jax.tree.map(lambda field: field[counted], trajectory)

    exact = partial(_steady_cavity, case.reynolds, density) if case.steady else scene.exact

    def wanted(position, time):
        return [np.asarray(field) for field in exact(np.asarray(position, float), float(time))]

    speed = float(scene.fluid.reference_speed)
    scales = math.sqrt(run.particles) * np.array([speed, density * speed**2])
    truths = [wanted(*at) for at in zip(run.position, run.time, strict=True)]
    found = {
        "velocity": [
            _relative(a, b, scales[0]) for a, (b, _) in zip(run.velocity, truths, strict=True)
        ],
        "pressure": [
            _fluctuation(a, b, scales[1]) for a, (_, b) in zip(run.pressure, truths, strict=True)
        ],
    }
    if case.steady:
        points, pressure = _mean_pressure(scene, run)
        found["pressure"] = [_fluctuation(pressure, wanted(points, run.time[-1])[1], scales[1])]
    return {
        f"{field}_{name}_percent": float(rule(values))
        for field, values in found.items()
        for name, rule in (("peak", np.max), ("median", np.median))
    }


def _mean_pressure(scene: Scene, run: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    """Points (P, 2) and the mean over time of the pressure there (P,)."""
    if np.array_equal(run.position[0], run.position[-1]):  # a model on reference points
        return run.position[0], run.pressure.mean(axis=0)
    points = np.asarray(scene.state.position)
    return points, probe(run, points, scene.space, MovingLeastSquaresMap)[1].mean(axis=0)


def _steady_cavity(reynolds: float, density: float, position: np.ndarray, time: float):
    """Velocity (P, 2) [m/s] and pressure (P,) [Pa] at points, at any time."""
    flow, inside = _cavity(reynolds), np.clip(position, 0.0, 1.0)
    return flow.velocity(inside), density * flow.pressure(inside)


@cache
def _cavity(reynolds: float) -> CavityFlow:
    return solve(reynolds, regularised_lid)


def _relative(found: np.ndarray, true: np.ndarray, scale: float) -> float:
    apart = np.linalg.norm(np.asarray(found, float) - true)
    return 100.0 * float(apart / (np.linalg.norm(true) or scale))


def _fluctuation(found: np.ndarray, true: np.ndarray, scale: float) -> float:
    return _relative(np.asarray(found, float) - found.mean(), true - true.mean(), scale)


def command(name: str, case: Case, setting: Setting, time_step: float) -> str:
    """How a user runs a setting: a command line, or a Python call where there is none."""
    if isinstance(setting, ReducedSetting):
        return _reduced_command(name, case, setting, time_step)
    own = FullSetting(setting.resolution, setting.h_over_dx, setting.step, start=setting.start)
    plain = dataclasses.replace(own, precision=setting.precision, scheme=setting.scheme)
    if setting == plain and setting.start == ("packed" if name == "taylor-green" else "rest"):
        sizes = _sizes(setting, case, time_step)
        given = f"--precision {setting.precision} --scheme {setting.scheme}"
        return f"jaxsph run {name} --reynolds {case.reynolds:g} {sizes} {given}"
    call = (
        f"{name.replace('-', '_')}({setting.resolution}, {case.reynolds!r}, "
        f"h_over_dx={setting.h_over_dx!r}, time_step={time_step!r}, end_time={case.end_time!r}, "
        f"mach={setting.mach!r}, kernel=jaxsph.kernels.{setting.kernel}(), "
        f"arrangement=jaxsph.arrangements.{STARTS[setting.start].__name__}(), "
        f"scheme=jaxsph.schemes.{type(SCHEMES[setting.scheme]).__name__}(), "
        f"dtype={setting.precision!r})"
    )
    left_out = [] if setting.shifting else ["ParticleShifting", "ShiftingTransport"]
    if setting.delta == 0.0:
        left_out.append("DensityDiffusion")
    lines = ["import dataclasses", "import jaxsph", f"scene = jaxsph.scenes.{call}"]
    if left_out:
        lines.append(
            "scene = dataclasses.replace(scene, effects=tuple(e for e in scene.effects if e.name "
            f"not in {left_out!r}))"
        )
    elif setting.delta != own.delta:
        lines.append(
            "scene = dataclasses.replace(scene, effects=tuple(jaxsph.effects.DensityDiffusion("
            f"{setting.delta!r}) if e.name == 'DensityDiffusion' else e for e in scene.effects))"
        )
    if setting.start == "quiet":
        lines.append("scene = jaxsph.scenes.balanced(scene)")
    return "\n".join([*lines, "run = jaxsph.run_scene(scene)"])


def _sizes(setting: Setting, case: Case, time_step: float) -> str:
    return (
        f"--resolution {setting.resolution} --h-over-dx {setting.h_over_dx:g} "
        f"--time-step {time_step!r} --t-end {case.end_time:g}"
    )


def _reduced_command(name, case: Case, setting: ReducedSetting, time_step: float) -> str:
    if setting.family == SAMPLED:
        return "benchmarks.work_precision.reduced.sampled (jaxsph_rom.points.SampledRates)"
    quietly = setting.start == "quiet"
    parts = [
        f"jaxsph-rom run {name} --scheme {setting.training.scheme} "
        f"--train {' '.join(f'{re:g}' for re in case.trained_on)} "
        f"--predict {case.reynolds:g} --modes {setting.modes}",
        _sizes(setting, case, time_step),
        f"--inner-product {setting.product}",
    ]
    if setting.family == TENSOR:
        parts.append(f"--hyper tensor --formulation {setting.formulation}")
        parts.append(f"--closure {setting.closure}")
    if setting.family == MOVING:
        parts.append("--hyper none tensor" if quietly else "--hyper none")  # tensor: a quiet start
        parts.append(f"--projection {setting.projection}")
        if setting.tau is not None:
            parts.append(f"--tau {setting.tau}")
        parts.append(f"--advection {setting.advection} --map {setting.map}")
        parts.append(f"--interpolation {setting.interpolation}")
        parts.append(f"--spline-order {setting.spline_order}")
    return " ".join(parts)
