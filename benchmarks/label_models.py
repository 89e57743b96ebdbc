"""Reduced models on labels, of flows with a free surface, at unseen parameters.

    python -m benchmarks.label_models --scenes standing-wave --resolutions 32

One row for each run. Heights are those of a wave gauge (`jaxsph.metrics.surface_height`); errors
are the largest at any time, in percent of the wave's largest height over rest. Floor: of the full
run's own projection on the modes. Sound: what a low-pass takes from the full run's gauge.
`sampled` rows are runs of the full functional at a few particles, projected on the first modes;
`galerkin` rows of that at all particles, projected on all modes, at the full model's cost. Full
runs are kept in a folder; times are process times of both models, in turns.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from jaxsph import ParticleState, Trajectory
from jaxsph.cli import positive_int
from jaxsph.environment import environment
from jaxsph.integrate import integrate, rk4_step
from jaxsph.metrics import surface_height
from jaxsph.scenes import Scene, sloshing, standing_wave
from jaxsph.scenes.sloshing import natural_frequency
from jaxsph.scenes.standing_wave import FREQUENCY
from jaxsph_rom import low_pass
from jaxsph_rom.labels import LabelModel, label_snapshots, parted_share, train
from jaxsph_rom.points import QDEIM
from jaxsph_rom.study import full_run

from .measure import alternate, format_rows, number, progress, summary, tell
from .table import Table, command

KEY = ("scene", "resolution", "modes", "model", "parameters")
MODELS = ("labels", "sampled", "galerkin")
_REPEATS = 5
_GALERKIN = 12  # modes of motion and of density, all of which are projected


@dataclass(frozen=True)
class Case:
    """A scene, where it is learnt from and judged.

    Args:
        make: resolution and parameters -> scene.
        trained_on, unseen: parameters.
        gauge: [m].
        period: of the wave [s].
        modes: numbers of coordinates.
        resolutions: along the scene.
        galerkin: whether the projected functional is run, too.
        samples: particles of the sampled one.
    """

    make: Callable[..., Scene]
    trained_on: list[dict[str, float]]
    unseen: list[dict[str, float]]
    gauge: float
    period: float
    modes: tuple[int, ...] = (3, 4)
    resolutions: tuple[int, ...] = (32, 48)
    galerkin: bool = True
    samples: int = 16

    def of(self, model: str, modes: int) -> list[dict[str, float]]:
        """Parameters that a kind of model is run at."""
        match model:
            case "labels":
                return [*self.trained_on, *self.unseen]
            case "sampled":
                return self.unseen
            case _:
                return self.unseen[:1] if self.galerkin and modes == max(self.modes) else []


def _wave(resolution: int, amplitude: float, reynolds: float) -> Scene:
    """Ten periods, a snapshot every tenth of a second."""
    step = 0.4 / resolution
    scene = standing_wave(
        resolution, reynolds, amplitude=amplitude, time_step=step, end_time=36.0
    )
    return replace(scene, steps_per_snapshot=round(0.1 / step))


def _corners(**ends: tuple[float, float]) -> list[dict[str, float]]:
    (one, first), (two, second) = ends.items()
    return [{one: a, two: b} for a in first for b in second]


def _tank(resolution: int, amplitude: float) -> Scene:
    """Ten periods of shaking at 0.8 times the first natural frequency, 30 snapshots each."""
    step = 3e-3 * 38 / resolution
    end = 10.0 * 2.0 * math.pi / (0.8 * natural_frequency())
    each = round(end / 300 / step)
    scene = sloshing(
        resolution, amplitude=amplitude, time_step=end / (300 * each), end_time=end
    )
    return replace(scene, steps_per_snapshot=each)


CASES = {
    "standing-wave": Case(
        _wave,
        _corners(amplitude=(0.03, 0.06), reynolds=(500.0, 1000.0)),
        [
            {"amplitude": 0.045, "reynolds": 700.0},
            {"amplitude": 0.05, "reynolds": 700.0},
            {"amplitude": 0.035, "reynolds": 850.0},
            {"amplitude": 0.07, "reynolds": 1250.0},  # beyond what was learnt
        ],
        gauge=0.0,
        period=2.0 * math.pi / FREQUENCY,
    ),
    "sloshing": Case(
        _tank,
        [{"amplitude": a} for a in (0.002, 0.004)],
        [{"amplitude": a} for a in (0.003, 0.0045)],
        gauge=0.0,
        period=2.0 * math.pi / (0.8 * natural_frequency()),
        modes=(3, 4),
        resolutions=(38,),
        galerkin=False,
    ),
}


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: a full run failed, 2: bad input."""
    return command("label_models", __doc__, _arguments, _run, argv)


def _arguments(add) -> None:
    add("--scenes", choices=tuple(CASES), nargs="+", default=list(CASES), help="default: all")
    add("--models", choices=MODELS, nargs="+", default=list(MODELS), help="default: all")
    add("--resolutions", type=positive_int, nargs="+", metavar="N", help="default: two per scene")
    add("--out", type=Path, default=Path("out/label-models"), metavar="DIR",
        help="where full runs are kept (default: %(default)s)")  # fmt: skip


def _run(options) -> None:
    kept = Table(options.json, KEY, beside=lambda rows: environment())
    for name in options.scenes:
        case = CASES[name]
        for resolution in options.resolutions or case.resolutions:
            judge = Judge(name, case, resolution, options.out)
            for modes in case.modes:
                for model in options.models:
                    for row in judge.rows(model, modes, kept):
                        kept.add(row)
    print(table(kept.rows))


class Judge:
    """Full runs of a case at a resolution, and reduced runs beside them."""

    def __init__(self, name: str, case: Case, resolution: int, folder: Path):
        self.name, self.case, self.resolution = name, case, resolution
        self.scene = cache(lambda *point: case.make(resolution, *point))
        self.folder = folder
        self.full = cache(self._full)

    def _full(self, *point: float) -> Trajectory:
        place = "-".join([self.name, str(self.resolution), *(f"{value:g}" for value in point)])
        return full_run(self.folder, self.scene(*point), progress, place)

    def rows(self, model: str, modes: int, kept: Table):
        """A row for each training point and each unseen one that the kind of model is run at."""
        case = self.case
        here = {"scene": self.name, "resolution": self.resolution, "modes": modes, "model": model}
        wanted = list(kept.left(here | {"parameters": point} for point in case.of(model, modes)))
        if not wanted:
            return
        runs = [self.full(*point.values()) for point in case.trained_on]
        tell(f"{self.name}: {model}, {modes} coordinates")
        chosen = {"sampling": QDEIM(case.samples)} if model == "sampled" else {}
        make = partial(case.make, self.resolution)
        trained = train(make, case.trained_on, modes, runs=runs, **chosen)
        run = self._galerkin if model == "galerkin" else self._labels
        for key in wanted:
            yield {**key, **run(trained, key["parameters"])}

    def _labels(self, trained: LabelModel, point) -> dict[str, Any]:
        scene, full = self.scene(*point.values()), self.full(*point.values())
        prediction = trained.predict(point)
        found = prediction.fields(0)
        row = self._judged(trained, point, found)
        step, each = jnp.asarray(scene.time_step), scene.steps_per_snapshot
        model = scene.model()
        interval = jax.jit(lambda state: integrate(model, state, np.int32(0), step, each, 1)[0])
        _, busy = alternate(
            {
                "full": lambda: jax.block_until_ready(interval(scene.state)),
                "reduced": lambda: trained.predict(point),  # twice, and laws: none compiles anew
            },
            _REPEATS,
        )
        seconds = {
            "full": summary([s * scene.steps / each for s in busy["full"]])["median"],
            "reduced": summary([0.5 * s for s in busy["reduced"]])["median"],
        }
        speed = np.linalg.norm(full.velocity, axis=2).max()
        away = np.linalg.norm(found.velocity - full.velocity[: len(found.time)], axis=2)
        return row | {
            "trained_on": len(self.case.trained_on),
            "members": trained.training.get("members"),
            "seen": point in self.case.trained_on,
            "outside": bool(prediction.outside[0]),
            "particles": full.particles,
            "steps": scene.steps,
            "fault": int(prediction.status[0]),
            "velocity_median_percent": float(100.0 * np.median(away) / speed),
            "parted_share": float(parted_share(full, scene.space).max()),
            "full_process_seconds": seconds["full"],
            "reduced_process_seconds": seconds["reduced"],
            "times_faster": seconds["full"] / seconds["reduced"],
            "offline_seconds": trained.training["offline_seconds"],
            "error_on_its_runs_percent": 100.0 * trained.training["error"],
        }

    def _galerkin(self, trained: LabelModel, point) -> dict[str, Any]:
        scene = self.scene(*point.values())
        return self._judged(trained, point, projected_run(trained, scene))

    def _judged(self, trained: LabelModel, point, found: Trajectory) -> dict[str, Any]:
        """Errors of the gauge's height, over the wave's largest."""
        scene, full = self.scene(*point.values()), self.full(*point.values())
        time = full.time
        heights = [
            surface_height(run, scene, self.case.gauge)
            for run in (full, projection(trained, full, scene), found)
        ]
        truth, floor, reached = heights
        rest = float(np.mean(truth[len(truth) // 2 :]))
        height = float(np.abs(truth - rest).max())
        cutoff = float(scene.fluid.sound_speed) / (8.0 * _depth(scene))
        quiet = low_pass(truth[None, None, :], time, cutoff)[0, 0]

        def percent(other, wanted=truth):
            return 100.0 * np.abs(other - wanted[: len(other)]) / height

        errors = percent(reached)
        periods = [
            errors[(time[: len(errors)] >= k * self.case.period)
                   & (time[: len(errors)] < (k + 1) * self.case.period)]
            for k in range(10)
        ]  # fmt: skip
        return {
            "wave_height": height,
            "height_error_percent": float(errors.max()),
            "height_error_mean_percent": float(errors.mean()),
            "height_error_by_period_percent": [float(p.max()) if len(p) else None for p in periods],
            "height_floor_percent": float(percent(floor).max()),
            "sound_percent": float(percent(quiet).max()),
            "reached_periods": float(found.time[-1] / self.case.period),
        }


def _depth(scene: Scene) -> float:
    return float(np.ptp(np.asarray(scene.state.position)[:, -1])) + scene.space.spacing


def projection(trained: LabelModel, full: Trajectory, scene: Scene) -> Trajectory:
    """A full run's own projection on all modes."""
    motion, density = label_snapshots(full, scene.space.box)
    bases = zip((trained.motion, trained.density), (motion, density), strict=True)
    motion, density = (basis.numbers(basis.project(numbers)) for basis, numbers in bases)
    way = motion[:, : motion.shape[1] // 2].reshape(full.position.shape)
    return replace(full, position=trained.labels + way, density=density)


def projected_run(trained: LabelModel, scene: Scene) -> Trajectory:
    """The full functional on all modes of motion and density by Galerkin projection:

        db/dt = Phi^T S f(c + S^-1 Phi b),

    each in its own product, with a neighbour list for each snapshot's interval.
    What is not finite ends the run.
    """
    motion, density = (
        jax.tree.map(jnp.asarray, basis) for basis in (trained.motion, trained.density)
    )
    labels, model = jnp.asarray(trained.labels), scene.model()
    step, each = jnp.asarray(scene.time_step), scene.steps_per_snapshot

    def state(b):
        way, velocity = jnp.split(motion.numbers(b[: motion.size]), 2)
        shape = labels.shape
        return ParticleState(
            labels + way.reshape(shape), velocity.reshape(shape), density.numbers(b[motion.size :])
        )

    def interval(b, number):
        auxiliary = model.search.build(state(b).position)

        def rates(time, b):
            found = model.functional(time, state(b), auxiliary)
            moved = jnp.concatenate([found.position.reshape(-1), found.velocity.reshape(-1)])
            return jnp.concatenate(
                [(moved * motion.scale) @ motion.modes,
                 (found.density * density.scale) @ density.modes]
            )  # fmt: skip

        def one(b, k):
            time = step * (number * each + k).astype(step.dtype)
            return rk4_step(rates, time, b, step), None

        b, _ = lax.scan(one, b, jnp.arange(each))
        return b, b

    velocity = scene.state.velocity.reshape(-1)
    start = jnp.concatenate([
        motion.project(jnp.concatenate([jnp.zeros_like(velocity), velocity])),
        density.project(scene.state.density),
    ])  # fmt: skip
    count = scene.schedule.intervals
    found = jax.jit(lambda b: lax.scan(interval, b, jnp.arange(count))[1])(start)
    found = np.concatenate([np.asarray(start)[None], np.asarray(found)])
    good = int(np.argmax(np.append(~np.isfinite(found).all(axis=1), True)))
    states = [jax.tree.map(np.asarray, state(jnp.asarray(b))) for b in found[:good]]
    position, velocity, dense = (
        np.stack([getattr(s, name) for s in states])
        for name in ("position", "velocity", "density")
    )
    return Trajectory(scene.schedule.times[:good], position, velocity, dense, 0.0 * dense)


def table(rows: list[dict[str, Any]]) -> str:
    """A run a line."""
    header = ("scene", "particles", "modes", "model", "parameters", "height error %", "floor %",
              "sound %", "periods", "times faster")  # fmt: skip
    lines = [
        (
            row["scene"],
            str(row.get("particles", "")),
            str(row["modes"] if row["model"] != "galerkin" else 2 * _GALERKIN),
            row["model"] + (", seen" if row.get("seen") else ""),
            ", ".join(f"{value:g}" for value in row["parameters"].values()),
            number(row["height_error_percent"]),
            number(row["height_floor_percent"]),
            number(row["sound_percent"]),
            number(row["reached_periods"]),
            number(row.get("times_faster")),
        )
        for row in rows
    ]
    return format_rows(header, lines)


if __name__ == "__main__":
    raise SystemExit(main())
