"""Flows with a free surface, shear layers and the Gresho vortex against what is known of them.

    python -m benchmarks.free_flows --scenes dam-break standing-wave --resolutions 75 150

One row per scene and resolution: the error against an exact solution, an experiment or a conserved
quantity, beside the run's time. Every finished run's row is in the JSON file at once; the same
command goes on where it was cut short. A run that ends in a fault is a row that names it.
"""

from __future__ import annotations

import argparse
import inspect
import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.optimize import curve_fit
from scipy.spatial import cKDTree

from jaxsph import SimulationError, Trajectory, run_scene
from jaxsph.cli import positive_int
from jaxsph.effects import FreeSlip
from jaxsph.environment import environment
from jaxsph.integrate import AutomaticSteps, FixedSteps
from jaxsph.metrics import surface_height
from jaxsph.scenes import SCENES, Scene
from jaxsph.scenes.dam_break import GRAVITY, dam_break
from jaxsph.scenes.elliptic_drop import semi_axes
from jaxsph.scenes.gresho_vortex import gresho_velocity
from jaxsph.scenes.piston_wave_maker import wave_height, wave_number
from jaxsph.scenes.sloshing import DEPTH as WATER
from jaxsph.scenes.sloshing import SPEED, linear_elevation
from jaxsph.scenes.standing_wave import damping
from jaxsph.schemes import Scheme

from .both_schemes import SCHEMES
from .measure import format_rows, number, progress
from .references.dam_break import (
    FRONT,
    FRONT_TIME,
    SENSOR_HEIGHT,
    SENSOR_PRESSURE,
    SENSOR_TANK,
    SENSOR_TIME,
)
from .table import Table, command

KEY = ("scene", "resolution", "scheme")
IMPACT_HEIGHT = 0.6  # m, H of Buchner's column
STEPPING = {"dam-break-impact": AutomaticSteps()}  # jets are faster than fixed steps allow for
RESOLUTIONS = {
    "dam-break": (75, 150),
    "dam-break-impact": (161, 242),
    "sloshing": (38, 76),
    "standing-wave": (40, 80),
    "elliptic-drop": (25, 50),
    "oscillating-drop": (40, 60),
    "rotating-square-patch": (25, 50),
    "piston-wave-maker": (120, 240),
    "shear-layer": (48, 96),
    "gresho-vortex": (48, 96),
}


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 2: bad input."""
    return command("free_flows", __doc__, _arguments, _run, argv)


def _run(options) -> None:
    kept = Table(options.json, KEY[:2], beside=lambda rows: environment())
    for row in kept.rows:
        row.setdefault("scheme", "delta-plus")  # there was no other
    for case in kept.left(_cases(options)):
        kept.add(run(*case.values()))
    print(_table(kept.rows))


def _cases(options):
    for name in options.scenes:
        for size in options.resolutions or RESOLUTIONS[name]:
            for scheme in _schemes(name, options):
                yield dict(zip(KEY, (name, size, scheme), strict=True))


def _arguments(add) -> None:
    names = tuple(RESOLUTIONS)
    add("--scenes", nargs="+", choices=names, default=names, help="default: all")
    add("--resolutions", nargs="+", type=positive_int, metavar="N", help="default: two per scene")
    add("--schemes", nargs="+", choices=tuple(SCHEMES), default=tuple(SCHEMES),
        help="default: all that a scene has")  # fmt: skip


def _make(name: str) -> Callable[..., Scene]:
    return SCENES.get(name, _impact_scene)


def _schemes(name: str, options: argparse.Namespace) -> tuple[str, ...]:
    """Those asked for; a drop under surface tension has effects of its own, as delta-plus has."""
    free = "scheme" in inspect.signature(_make(name)).parameters
    return options.schemes if free else ("delta-plus",)


def run(name: str, resolution: int, scheme: str) -> dict[str, Any]:
    """A full run of a scene and its row."""
    make = _make(name)
    chosen = {"scheme": SCHEMES[scheme]} if "scheme" in inspect.signature(make).parameters else {}
    scene = make(resolution=resolution, **chosen)
    row = {
        "scene": name,
        "resolution": resolution,
        "scheme": scheme,
        "particles": len(scene.state.position),
        "effects": [effect.name for effect in scene.effects],
        "steps": scene.steps,
        "end_time": scene.end_time,
    }
    fault = None
    with progress(name, scene.steps) as report:
        try:
            trajectory = run_scene(
                scene, progress=report, stepping=STEPPING.get(name, FixedSteps())
            )
        except SimulationError as error:
            fault, trajectory = str(error), error.trajectory
    row |= {
        "fault": fault,
        "seconds": trajectory.timing.run_seconds,
        "compile_seconds": trajectory.timing.compile_seconds,
        "reached": float(trajectory.time[-1]),
        **_common(scene, trajectory),
    }
    return row if fault else row | MEASURES[name](scene, trajectory)


def _common(scene: Scene, trajectory: Trajectory) -> dict[str, Any]:
    """Densities, kinetic energy, and how evenly particles lie at the end."""
    ratio = trajectory.density / float(scene.fluid.reference_density)
    energy = _kinetic(trajectory)
    tree = cKDTree(trajectory.position[-1])
    nearest = tree.query(trajectory.position[-1], 2)[0][:, 1] / scene.space.spacing
    return {
        "density_low": float(ratio.min()),
        "density_high": float(ratio.max()),
        "kinetic_energy_peak_over_start": float(energy.max() / energy[0]) if energy[0] else None,
        "nearest_over_dx_least": float(nearest.min()),
        "nearest_over_dx_spread": float(nearest.std()),
    }


def _kinetic(trajectory: Trajectory) -> np.ndarray:
    """Kinetic energy per particle mass (snapshots,)."""
    return 0.5 * (trajectory.velocity**2).sum(axis=(1, 2))


def _dam_break(scene: Scene, trajectory: Trajectory) -> dict[str, Any]:
    """The front along the floor against the experiment, up to its last measured place."""
    width, tank = scene.parameters["column"][0], scene.parameters["tank"][0]
    scaled = trajectory.time * np.sqrt(2.0 * GRAVITY / width)
    front = (trajectory.position[:, :, 0].max(axis=1) + 0.5 * scene.space.spacing) / width
    found = np.interp(FRONT_TIME, scaled, front)
    error = 100.0 * (found / np.asarray(FRONT) - 1.0)
    hit = np.argmax(front > tank / width - 0.6 * scene.space.spacing / width)
    return {
        "measure": "front, relative to Martin and Moyce (1952) [percent]",
        "error_percent": float(np.abs(error).mean()),
        "error_percent_peak": float(np.abs(error).max()),
        "front_over_width": found.tolist(),
        "impact_time": float(trajectory.time[hit]),
    }


def _impact_scene(resolution: int, scheme: Scheme) -> Scene:
    """The dam break of Buchner (2002), water that hits a wall with a pressure sensor in it."""
    tank = tuple(IMPACT_HEIGHT * length for length in SENSOR_TANK)
    end = 5.4 * math.sqrt(IMPACT_HEIGHT / GRAVITY)
    column = (2.0 * IMPACT_HEIGHT, IMPACT_HEIGHT)
    sound_speed = 30.0 * math.sqrt(GRAVITY * IMPACT_HEIGHT)
    steps = 30 * math.ceil(end * sound_speed / (2.0 * tank[0] / resolution) / 30)  # dt = h / c0
    scene = dam_break(
        resolution,
        column=column,
        tank=tank,
        end_time=end,
        time_step=end / steps,
        scheme=scheme,
        wall_velocity=FreeSlip(),  # a tongue that sticks to the floor comes late, see `dam_break`
    )
    return replace(scene, steps_per_snapshot=10)


def _impact(scene: Scene, trajectory: Trajectory) -> dict[str, Any]:
    """The pressure on the sensor against the experiment, up to its last kept time.

    Shepard's mean of the particles' pressure within the kernel's support of the sensor's middle,
    zero where there is none.
    """
    space, scale = scene.space, 1000.0 * GRAVITY * IMPACT_HEIGHT
    sensor = np.asarray([space.box.upper[0], SENSOR_HEIGHT * IMPACT_HEIGHT])
    apart = np.linalg.norm(trajectory.position - sensor, axis=2)
    weight = np.asarray(space.kernel.value(apart, space.smoothing_length, 2))
    total = weight.sum(axis=1)
    mean = (weight * trajectory.pressure).sum(axis=1) / np.where(total > 0.0, total, 1.0) / scale
    time = trajectory.time * np.sqrt(GRAVITY / IMPACT_HEIGHT)
    found = np.interp(SENSOR_TIME, time, mean)
    plateau = np.asarray(SENSOR_TIME) > 3.5
    impulses = [np.trapezoid(p, SENSOR_TIME) for p in (found, SENSOR_PRESSURE)]
    arrivals = [np.interp(0.2, p[:9], SENSOR_TIME[:9]) for p in (found, SENSOR_PRESSURE)]
    return {
        "measure": "impulse on the sensor to T = 5.2, relative to Buchner (2002) [percent]",
        "error_percent": 100.0 * abs(impulses[0] / impulses[1] - 1.0),
        "plateau_error_percent": 100.0
        * float(found[plateau].mean() / np.mean(np.asarray(SENSOR_PRESSURE)[plateau]) - 1.0),
        "arrival": arrivals[0],
        "arrival_expected": arrivals[1],
        "peak_pressure": float(mean[time < 3.0].max()),
        "sensor_time": time.tolist(),
        "sensor_pressure": mean.tolist(),
    }


def _standing_wave(scene: Scene, trajectory: Trajectory) -> dict[str, Any]:
    """Decay rate and period of the kinetic energy, by a fit of a damped cosine."""
    time, energy = trajectory.time, _kinetic(trajectory)
    energy = energy / energy[0]
    rate, frequency = damping(1.0 / scene.parameters["reynolds"])

    def wave(t, size, rate, frequency):
        return size * np.exp(-rate * t) * np.cos(frequency * t) ** 2

    fitted, _ = curve_fit(wave, time, energy, (1.0, rate, frequency))
    return {
        "measure": "decay of energy, relative to that of the linear viscous wave [percent]",
        "error_percent": 100.0 * abs(fitted[1] / rate - 1.0),
        "decay_per_second": fitted[1],
        "decay_expected": rate,
        "frequency_error_percent": 100.0 * (fitted[2] / frequency - 1.0),
    }


def _sloshing(scene: Scene, trajectory: Trajectory) -> dict[str, Any]:
    """The wave gauge at the left wall against linear theory, its level at rest left out."""
    amplitude, frequency, reynolds = (
        scene.parameters[name] for name in ("amplitude", "frequency", "reynolds")
    )
    viscosity = SPEED * WATER / reynolds
    wanted = linear_elevation(0.0, trajectory.time, amplitude, frequency, viscosity)
    height = surface_height(trajectory, scene, 0.0)
    off = height - wanted
    off -= off.mean()
    return {
        "measure": "wave at the wall, root mean square relative to linear theory [percent]",
        "error_percent": 100.0 * float(np.sqrt(np.mean(off**2) / np.mean(wanted**2))),
        "height_over_linear": float(np.ptp(height) / np.ptp(wanted)),
        "level_change_percent": 100.0 * float((height - wanted).mean() / WATER - 1.0),
    }


def _elliptic_drop(scene: Scene, trajectory: Trajectory) -> dict[str, Any]:
    """The semi-axes, from second moments, against the exact ones; and the period."""
    moments = 2.0 * np.sqrt((trajectory.position**2).mean(axis=1))
    start = np.sqrt(4.0 * (trajectory.position[0] ** 2).mean())
    moments = moments / start
    exact = np.stack(semi_axes(trajectory.time, scene.parameters["pull"]), axis=1)
    error = 100.0 * np.abs(moments / exact - 1.0)
    periods = [_crossing_period(trajectory.time, a[:, 0] - a[:, 1]) for a in (moments, exact)]
    return {
        "measure": "semi-axes, relative to the exact ones, mean over time [percent]",
        "error_percent": float(error.mean()),
        "error_percent_peak": float(error.max()),
        "period": periods[0],
        "period_error_percent": 100.0 * (periods[0] / periods[1] - 1.0),
    }


def _crossing_period(time: np.ndarray, wave: np.ndarray) -> float:
    """Twice the mean time between zeros [s], the start not counted as one."""
    turns = np.nonzero(wave[1:-1] * wave[2:] < 0.0)[0] + 1
    zeros = time[turns] - wave[turns] * np.diff(time)[turns] / (wave[turns + 1] - wave[turns])
    return 2.0 * float(np.diff(zeros).mean()) if len(zeros) > 1 else float("nan")


def _oscillating_drop(scene: Scene, trajectory: Trajectory) -> dict[str, Any]:
    """Period and decay of the second moment's difference, by a fit of a damped sine."""
    squares = (trajectory.position**2).mean(axis=1)
    wave = squares[:, 0] - squares[:, 1]
    exact = np.sqrt(6.0)  # rad/s: sigma = rho0 = R = 1
    decay = 4.0 / scene.parameters["reynolds"]

    def sine(t, size, rate, frequency, phase, middle):
        return size * np.exp(-rate * t) * np.sin(frequency * t + phase) + middle

    fitted, _ = curve_fit(sine, trajectory.time, wave, (wave.max(), decay, exact, 0.0, 0.0))
    return {
        "measure": "period, relative to Rayleigh's [percent]",
        "error_percent": 100.0 * abs(exact / fitted[2] - 1.0),
        "period": 2.0 * np.pi / fitted[2],
        "decay_per_second": fitted[1],
        "decay_expected": decay,
    }


def _rotating_patch(scene: Scene, trajectory: Trajectory) -> dict[str, Any]:
    """What turning fluid keeps: its angular momentum; and its fourfold shape."""
    x, u = trajectory.position, trajectory.velocity
    spin = (x[:, :, 0] * u[:, :, 1] - x[:, :, 1] * u[:, :, 0]).sum(axis=1)
    energy = _kinetic(trajectory)
    turned = np.stack([-x[-1][:, 1], x[-1][:, 0]], axis=1)
    apart = cKDTree(x[-1]).query(turned)[0] / scene.space.spacing
    return {
        "measure": "angular momentum lost by the end [percent]",
        "error_percent": 100.0 * abs(spin[-1] / spin[0] - 1.0),
        "kinetic_energy_lost_percent": 100.0 * (1.0 - energy[-1] / energy[0]),
        "arm_length": float(np.sqrt((x[-1] ** 2).sum(axis=1).max())),
        "asymmetry_over_dx": float(np.median(apart)),
    }


def _piston(scene: Scene, trajectory: Trajectory) -> dict[str, Any]:
    """The height of the waves 0.9 m from the piston in the third period, before they come back.

    It is twice the first harmonic of the surface, the volume of water above a stretch of floor.
    """
    stroke, period = (scene.parameters[name] for name in ("stroke", "period"))
    width, gauge = 0.05, 0.9  # m
    apart = (trajectory.position[:, :, 0] - gauge) / width
    weight = np.exp(-0.5 * apart**2) / (width * math.sqrt(2.0 * math.pi))
    surface = (weight * float(scene.mass) / trajectory.density).sum(axis=1)
    third = (trajectory.time > 2.0 * period) & (trajectory.time <= 3.0 * period + 1e-9)
    phase = 2.0 * math.pi * trajectory.time[third] / period
    columns = np.stack([np.cos(phase), np.sin(phase), np.ones_like(phase)], axis=1)
    cosine, sine, _ = np.linalg.lstsq(columns, surface[third], rcond=None)[0]
    smoothed = math.exp(0.5 * (wave_number(period) * width) ** 2)  # the mean over the stretch
    height = 2.0 * math.hypot(cosine, sine) * smoothed
    return {
        "measure": "wave height, relative to linear theory [percent]",
        "error_percent": 100.0 * abs(height / wave_height(stroke, period) - 1.0),
        "height": height,
        "height_expected": wave_height(stroke, period),
    }


def _shear_layer(scene: Scene, trajectory: Trajectory) -> dict[str, Any]:
    """Momentum, and energy that only viscosity may take."""
    energy = _kinetic(trajectory)
    drift = np.abs(trajectory.velocity.mean(axis=1) - trajectory.velocity[0].mean(axis=0))
    return {
        "measure": "kinetic energy lost by the end [percent]",
        "error_percent": 100.0 * (1.0 - energy[-1] / energy[0]),
        "mean_velocity_drift": float(drift.max()),
    }


def _gresho(scene: Scene, trajectory: Trajectory) -> dict[str, Any]:
    """The velocity at the end against the steady one."""
    exact = np.asarray(gresho_velocity(trajectory.position[-1]))
    error = np.linalg.norm(trajectory.velocity[-1] - exact) / np.linalg.norm(exact)
    energy = _kinetic(trajectory)
    return {
        "measure": "velocity at the end, relative L2 [percent]",
        "error_percent": 100.0 * float(error),
        "kinetic_energy_lost_percent": 100.0 * (1.0 - energy[-1] / energy[0]),
    }


MEASURES: dict[str, Callable[[Scene, Trajectory], dict[str, Any]]] = {
    "dam-break": _dam_break,
    "dam-break-impact": _impact,
    "sloshing": _sloshing,
    "standing-wave": _standing_wave,
    "elliptic-drop": _elliptic_drop,
    "oscillating-drop": _oscillating_drop,
    "rotating-square-patch": _rotating_patch,
    "piston-wave-maker": _piston,
    "shear-layer": _shear_layer,
    "gresho-vortex": _gresho,
}


def _table(rows: list[dict[str, Any]]) -> str:
    header = ("scene", "resolution", "scheme", "particles", "error [%]", "of", "run [s]")
    header = (*header, "density / rho0")
    return format_rows(
        header,
        [
            (
                row["scene"],
                str(row["resolution"]),
                row["scheme"],
                str(row["particles"]),
                number(row.get("error_percent")),
                row["fault"] or row["measure"],
                number(row["seconds"]),
                f"{row['density_low']:.3f} to {row['density_high']:.3f}",
            )
            for row in rows
        ],
    )


if __name__ == "__main__":
    raise SystemExit(main())
