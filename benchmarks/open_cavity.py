"""The open cavity from rest: how it settles, its Reynolds number and its shedding.

    python -m benchmarks.open_cavity --resolution 100

The run is kept in a folder: the same command goes on where it was cut short. From its snapshots:
the bulk velocity of the channel and the Reynolds number that it makes with the cavity's length, the
frequency of the vertical velocity in the cavity's mouth, the time from which the kinetic energy,
averaged over a period, changes by less than a percent from one period to the next, its trend over
the second half of the run beside the viscous rate of the channel, and how near particles come to
walls.
"""

from __future__ import annotations

import dataclasses
from functools import partial
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxsph import Trajectory
from jaxsph.cli import positive_float, positive_int
from jaxsph.effects import LaminarViscosity
from jaxsph.environment import environment
from jaxsph.interpolation import ShepardMap
from jaxsph.scenes import Scene, open_cavity
from jaxsph.scenes.open_cavity import CAVITY_LENGTH, CHANNEL_HEIGHT
from jaxsph.schemes import DeltaPlus
from jaxsph_rom.study import full_run

from .measure import near_walls, number, progress, write_json
from .table import command

PROBE = (0.25, 0.0)  # m, in the mouth of the cavity, on the paper's slice
SNAPSHOTS_PER_SECOND = 50
SAMPLED = 1.0  # s, the paper's final second
_SETTLED = 0.01  # relative change of the mean kinetic energy from period to period


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: the run failed, 2: bad input."""
    return command("open_cavity", __doc__, _arguments, _run, argv)


def _run(options) -> None:
    scene = _scene(options)
    results = measure(scene, full_run(options.out, scene, progress))
    write_json(options.json, results)
    print(_text(results))


def _arguments(add) -> None:
    add("--resolution", type=positive_int, default=100, metavar="N",
        help="particles per 0.4 m (default: %(default)s, a quarter of the paper's)")  # fmt: skip
    add("--reynolds", type=positive_float, default=2400.0, metavar="RE",
        help="nominal, which sets the viscosity (default: %(default)g)")  # fmt: skip
    add("--end-time", type=positive_float, default=12.0, metavar="T",
        help="[s] (default: %(default)g)")  # fmt: skip
    add("--out", type=Path, default=Path("out/open-cavity"), metavar="DIR",
        help="where the run is kept (default: %(default)s)")  # fmt: skip


def _scene(options) -> Scene:
    """The scene with some snapshots a second."""
    make = partial(
        open_cavity,
        options.resolution,
        options.reynolds,
        end_time=options.end_time,
        scheme=DeltaPlus(),
    )
    free = make()
    each = max(1, round(1.0 / (SNAPSHOTS_PER_SECOND * free.time_step)))
    intervals = int(np.ceil(options.end_time / (each * free.time_step)))
    scene = make(time_step=options.end_time / (each * intervals))
    return dataclasses.replace(scene, steps_per_snapshot=each)


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Any]:
    """All figures of a run."""
    viscosity = scene.parameters["reynolds"], float(_viscosity(scene))
    bulk = bulk_velocity(trajectory)
    energy = 0.5 * (trajectory.velocity.astype(float) ** 2).sum(axis=2).mean(axis=1)
    mouth = _at_probe(scene, trajectory)
    late = trajectory.time >= 0.5 * trajectory.time[-1]
    frequency = dominant_frequency(trajectory.time[late], mouth[late])
    sampled = trajectory.time >= trajectory.time[-1] - SAMPLED
    speed = float(bulk[sampled].mean())
    timing = trajectory.timing
    return {
        "bulk_velocity": speed,
        "nominal_reynolds": viscosity[0],
        "viscosity": viscosity[1],
        "measured_reynolds": speed * CAVITY_LENGTH / viscosity[1],
        "shedding_frequency": frequency,
        "strouhal_number": None if frequency is None else frequency * CAVITY_LENGTH / speed,
        "mouth_velocity_rms": float(np.std(mouth[late])),
        "settled_from": settling_time(trajectory.time, energy, frequency, _SETTLED),
        "energy_trend_percent_per_second": 100.0 * trend(trajectory.time[late], energy[late]),
        "viscous_trend_percent_per_second": -200.0 * viscosity[1] * (np.pi / CHANNEL_HEIGHT) ** 2,
        "energy_change_in_last_second_percent": _change(trajectory.time, energy),
        **near_walls(scene, trajectory),
        "time": trajectory.time,
        "bulk_velocity_over_time": bulk,
        "kinetic_energy_per_mass_over_time": energy,
        "mouth_velocity_over_time": mouth,
        "seconds": timing.seconds(scene.steps),
        "compile_seconds": timing.compile_seconds,
        "steps": scene.steps,
        "particles": trajectory.particles,
        "parameters": scene.parameters,
        "device": jax.devices()[0].device_kind,
        "environment": environment(),
    }


def _viscosity(scene: Scene):
    (found,) = (e.viscosity for e in scene.effects if isinstance(e, LaminarViscosity))
    return found


def bulk_velocity(trajectory: Trajectory) -> np.ndarray:
    """Mean velocity [m/s] along the channel of what is in it, at all times."""
    inside = trajectory.position[:, :, 1] > 0.0
    return (trajectory.velocity[:, :, 0] * inside).sum(axis=1) / inside.sum(axis=1)


def _at_probe(scene: Scene, trajectory: Trajectory) -> np.ndarray:
    """Vertical velocity [m/s] in the cavity's mouth at all times."""
    points = jnp.asarray([PROBE], trajectory.position.dtype)
    shepard = ShepardMap.allocate(points, scene.space)
    at = jax.jit(lambda position, values: shepard(position, values)[0])
    values = [
        at(position, velocity[:, 1:])[0, 0]
        for position, velocity in zip(trajectory.position, trajectory.velocity, strict=True)
    ]
    return np.asarray(values, float)


def dominant_frequency(time: np.ndarray, signal: np.ndarray) -> float | None:
    """Frequency [Hz] of the strongest oscillation; None for less than two periods of it.

    The peak of the windowed spectrum of the signal less its trend, placed by a parabola through the
    logarithms around it.
    """
    trend = np.polyfit(time, signal, 1)
    rest = (signal - np.polyval(trend, time)) * np.hanning(len(time))
    spectrum = np.abs(np.fft.rfft(rest))
    peak = int(np.argmax(spectrum[1:-1])) + 1
    low, middle, high = np.log(spectrum[peak - 1 : peak + 2] + 1e-300)
    curvature = low - 2.0 * middle + high
    shift = 0.5 * (low - high) / curvature if curvature < 0.0 else 0.0
    frequency = (peak + shift) / (len(time) * (time[1] - time[0]))
    return float(frequency) if frequency * (time[-1] - time[0]) > 2.0 else None


def settling_time(
    time: np.ndarray, values: np.ndarray, frequency: float | None, share: float
) -> float | None:
    """First time [s] from which means over a period change by less than `share` a period.

    None if that never comes, or there is no period.
    """
    if frequency is None:
        return None
    period = max(1, round(1.0 / (frequency * (time[1] - time[0]))))
    if len(values) < 2 * period + 1:
        return None
    means = np.convolve(values, np.full(period, 1.0 / period), "valid")
    change = np.abs(means[period:] - means[:-period]) / np.abs(means[:-period])
    moving = np.flatnonzero(change >= share)
    first = 0 if len(moving) == 0 else moving[-1] + 1
    return None if first >= len(change) else float(time[first])


def trend(time: np.ndarray, values: np.ndarray) -> float:
    """Relative change per second: the slope of a straight line through them, over their mean."""
    return float(np.polyfit(time, values, 1)[0] / values.mean())


def _change(time: np.ndarray, energy: np.ndarray) -> float:
    """Relative change [%] of the mean energy from the second before the last to the last."""
    last, before = time > time[-1] - 1.0, (time > time[-1] - 2.0) & (time <= time[-1] - 1.0)
    if not before.any():
        return float("nan")
    return float(100.0 * (energy[last].mean() / energy[before].mean() - 1.0))


def _text(results: dict[str, Any]) -> str:
    rows = (
        ("particles", str(results["particles"])),
        ("bulk velocity", f"{number(results['bulk_velocity'])} m/s"),
        ("Reynolds number", f"{results['measured_reynolds']:.0f} (nominal "
         f"{results['nominal_reynolds']:g})"),
        ("shedding", f"{number(results['shedding_frequency'])} Hz, "
         f"Strouhal number {number(results['strouhal_number'])}"),
        ("settled from", f"{number(results['settled_from'])} s"),
        ("trend", f"{number(results['energy_trend_percent_per_second'])} % of the kinetic energy a "
         f"second; viscous {number(results['viscous_trend_percent_per_second'])}"),
        ("kinetic energy", f"{number(results['energy_change_in_last_second_percent'])} % in the "
         "last second"),
        ("nearest to a wall", f"{number(results['nearest_to_wall_over_dx'])} dx"),
        ("beyond a wall", f"{results['beyond_wall']}, stuck to one {results['stuck']}"),
        ("density", f"{results['density_low']:.4f} to {results['density_high']:.4f} rho0"),
        ("run", f"{number(results['seconds'])} s for {results['steps']} steps"),
    )  # fmt: skip
    return "\n".join(f"{name:<18}{value}" for name, value in rows)


if __name__ == "__main__":
    raise SystemExit(main())
