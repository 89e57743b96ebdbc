"""Reduced models on moving particles at any number of modes: errors, pressure's level and waves.

    python -m benchmarks.particle_modes --resolution 50
    python -m benchmarks.particle_modes --scene lid-driven-cavity --train 100 --reynolds 100

The Taylor-Green vortex at a Reynolds number that nothing was trained on, from a lattice or packed
particles, the lid-driven cavity, or the open one once it has settled, in either scheme, by either
projection. Errors are those over the reference points, the pressure's mean and what is left of it
apart, and on the line of probes; a run that was named as it went, whose pressure is off by its own
range, or whose particles clump, is named. Beside them stand the floors, which is what the modes
make of the full run, the full model's own sound, which is its pressure less its low-pass, and the
errors of low-passed pressures. Runs are kept in a folder and finished rows in the JSON file: the
same command goes on.
"""

from __future__ import annotations

from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.optimize import minimize_scalar

from jaxsph import Trajectory
from jaxsph.cli import ARRANGEMENTS, positive_float, positive_int
from jaxsph.environment import environment
from jaxsph.metrics import relative_discrepancy
from jaxsph.scenes import SCENES
from jaxsph.schemes import SCHEMES
from jaxsph_rom import Experiment, OnParticles, Study, low_pass
from jaxsph_rom.study import PLANS, doubt, level_and_fluctuation

from .measure import format_rows, number, progress
from .particle_models import INTERPOLATIONS, PROJECTIONS
from .table import Table, command

KEY = ("scheme", "arrangement", "interpolation", "reynolds", "modes", "projection")
MODES = (1, 2, 3, 4, 5, 6, 8, 10, 12, 15, 20, 30, 40, 50)


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: a full run failed, 2: bad input."""
    json = "particle_modes_{scene}_{resolution}.json"
    return command("particle_modes", __doc__, _arguments, _run, argv, json=json)


def _arguments(add) -> None:
    add("--scene", choices=("taylor-green", "lid-driven-cavity", "open-cavity"),
        default="taylor-green", help="default: %(default)s")  # fmt: skip
    add("--interpolation", choices=tuple(INTERPOLATIONS),
        help="of modes at moving particles (default: polynomials on a lattice, else splines)")
    add("--cutoff", type=positive_float, metavar="HZ",
        help="of the low-pass (default: the slowest sound's c0 / 2 L)")  # fmt: skip
    add("--judged-from", type=float, default=0.0, metavar="T",
        help="time from which on errors count [s] (default: 0)")  # fmt: skip
    add("--resolution", type=positive_int, default=50, metavar="N", help="default: %(default)s")
    add("--end-time", type=positive_float, default=1.0, metavar="T", help="[s] (default: 1)")
    add("--train", type=positive_float, nargs="+", default=[110.0, 160.0, 230.0], metavar="RE",
        help="default: 110 160 230")  # fmt: skip
    add("--reynolds", type=positive_float, nargs="+", default=[137.0], metavar="RE",
        help="default: 137")  # fmt: skip
    add("--modes", type=positive_int, nargs="+", default=list(MODES), metavar="M",
        help=f"default: {' '.join(map(str, MODES))}")  # fmt: skip
    add("--schemes", choices=tuple(SCHEMES), nargs="+", default=["consistent"],
        help="default: consistent")  # fmt: skip
    add("--arrangements", choices=("lattice", "packed"), nargs="+", default=["lattice", "packed"],
        help="default: both")  # fmt: skip
    add("--projections", choices=tuple(PROJECTIONS), nargs="+", default=["galerkin"],
        help="default: galerkin")  # fmt: skip
    add("--out", type=Path, metavar="DIR", help="where runs are kept (default: "
        "out/particle-modes-SCENE-RESOLUTION)")  # fmt: skip


def _run(options) -> None:
    names = ("scene", "judged_from", "resolution", "end_time", "train", "cutoff")
    kept = Table(options.json, KEY, settings={name: getattr(options, name) for name in names})
    kept.results |= {"environment": environment(), "device": jax.devices()[0].device_kind}
    for scheme, arrangement in product(options.schemes, options.arrangements):
        usual = "polynomials" if arrangement == "lattice" else "splines"
        made = {"scheme": scheme, "arrangement": arrangement,
                "interpolation": options.interpolation or usual}  # fmt: skip
        for name, reynolds in product(options.projections, options.reynolds):
            case = made | {"reynolds": reynolds, "projection": name}
            left = [each["modes"] for each in kept.left(case | {"modes": m} for m in options.modes)]
            if not left:
                continue
            study, truth = _study(options, **made, name=name), None
            experiment = Experiment(tuple(options.train), (reynolds,), tuple(left))
            for outcome in study.run(experiment):
                truth = truth or _Truth(study, experiment, options)
                kept.add(case | {"modes": outcome.case.modes} | truth.row(outcome))
    print(_table(kept.rows))


def _study(options, scheme: str, arrangement: str, interpolation: str, name: str) -> Study:
    folder = options.out or Path("out", f"particle-modes-{options.scene}-{options.resolution}")

    folder, plan = folder / f"{scheme}-{arrangement}", PLANS[options.scene]
    make = partial(
        SCENES[options.scene],
        resolution=options.resolution,
        end_time=options.end_time,
        arrangement=ARRANGEMENTS[arrangement](seed=0),
        scheme=SCHEMES[scheme],
        dtype="float64",
    )
    scene = plan.scenes(make, folder, progress)
    method = OnParticles((PROJECTIONS[name],), interpolation=INTERPOLATIONS[interpolation])
    return Study(
        lambda reynolds: scene(reynolds=reynolds), folder, method,
        progress=progress, probes=plan.probes,
    )  # fmt: skip


class _Truth:
    """The full run on the reference points and on the line of probes."""

    def __init__(self, study: Study, experiment: Experiment, options):
        (reynolds,) = experiment.reynolds
        runs, (method,) = study.runs, study.methods
        self.scene, self.full = runs.scene(reynolds), runs.full(reynolds)
        self.reference = runs.reference(experiment.trained_on[0], method.rule)
        self.basis = method.basis(runs, experiment)
        self.snapshots = runs.mapped(reynolds, experiment.trained_on[0], method.rule)
        self.line = runs.profile(reynolds)
        self.counted = self.full.time >= options.judged_from
        box, fluid = self.scene.space.box, self.scene.fluid
        self.cutoff = options.cutoff or float(fluid.sound_speed) / (2.0 * max(box.lengths))

    def row(self, outcome) -> dict[str, Any]:
        """Errors of a run and of the projection of the full one, and what it cost."""
        run: Trajectory = outcome.trajectory
        found, count = self.reference.snapshots(run), len(run.time)
        basis = self.basis.truncated(outcome.case.modes)
        centred = self.snapshots[:, :, :count] - basis.centre[:, :, None]
        weighted = basis.modes * basis.weights[None, :, None]
        coordinates = np.einsum("gfm,gft->mt", weighted, centred)
        floor = np.einsum("gfm,mt->gft", basis.modes, coordinates) + basis.centre[:, :, None]
        wanted = self._fields(self.snapshots[:, :, :count])
        line = tuple(values[:count] for values in self.line)
        errors = self._errors(wanted, self._fields(found), "")
        errors |= self._errors(wanted, self._fields(floor), "floor_")
        errors |= self._errors(line, outcome.profile, "line_")
        fluctuation = level_and_fluctuation(wanted[1], self._fields(found)[1])[1]
        counted, case = self.counted[:count], outcome.case
        return errors | {
            "stable": case.stable,
            "fault": case.fault,
            "doubt": case.doubt,
            "lag_seconds": lag(run.time, self.snapshots[:, 1:, :count], found[:, 1:]),
            "judged": doubt(run, self.scene, run.time[counted], fluctuation[counted]),
            "seconds_per_step": case.rom_seconds and case.rom_seconds / case.rom_steps,
            "full_seconds_per_step": case.fom_seconds / case.fom_steps,
        }

    def _fields(self, snapshots) -> tuple[np.ndarray, np.ndarray]:
        """Speed and pressure, (times, points) each."""
        pressure = self.scene.fluid.pressure(jnp.asarray(snapshots[:, 0].T))
        return np.linalg.norm(snapshots[:, 1:], axis=1).T, np.asarray(pressure)

    def _errors(self, wanted, found, prefix: str) -> dict[str, float | None]:
        level, fluctuation = level_and_fluctuation(wanted[1], found[1])
        slow = [self._slow(pressure) for pressure in (wanted[1], found[1])]
        parts = {
            "velocity": relative_discrepancy(wanted[0], found[0]),
            "pressure": relative_discrepancy(wanted[1], found[1]),
            "level": level,
            "fluctuation": fluctuation,
            "slow_pressure": None if slow[0] is None else relative_discrepancy(*slow),
            "sound": None if slow[0] is None else relative_discrepancy(wanted[1], slow[0]),
        }
        if prefix == "floor_":
            del parts["sound"]
        return {
            f"{prefix}{name}_{what}_percent": None
            if percent is None
            else float(of(percent[self.counted[: len(percent)]]))
            for name, percent in parts.items()
            for what, of in (("peak", np.max), ("median", np.median))
        }

    def _slow(self, pressure: np.ndarray) -> np.ndarray | None:
        """Without what is faster than the cutoff; None of a run too short for the filter."""
        time = self.full.time[: len(pressure)]
        try:
            return low_pass(pressure.T[:, None, :], time, self.cutoff)[:, 0].T
        except ValueError:
            return None


def lag(
    time: Float[np.ndarray, " times"],
    wanted: Float[np.ndarray, "points dim times"],
    found: Float[np.ndarray, "points dim times"],
) -> float | None:
    """How much later [s] what is found goes through what is wanted, from two thirds to five sixths
    of the time: the shift of least squares between its velocities and the others', straight between
    snapshots. None where nothing changes, the best shift is a sixth of the time, or
    snapshots are fewer than twelve.

    Args:
        time: even [s].
        wanted: velocities of the full run [m/s].
        found: of the reduced one.
    """
    count = len(time)
    reach = count // 6
    if reach < 2:
        return None
    interval = time[1] - time[0]
    late = np.arange(count - 2 * reach, count - reach)

    def off(shift: float) -> float:  # in intervals
        place = late - shift
        before = np.clip(np.floor(place).astype(int), 0, count - 2)
        share = place - before
        there = wanted[:, :, before] * (1.0 - share) + wanted[:, :, before + 1] * share
        return float(np.sum((found[:, :, late] - there) ** 2))

    shifts = np.arange(-reach, reach + 1)
    errors = np.array([off(shift) for shift in shifts])
    nearest = int(shifts[np.argmin(errors)])
    if abs(nearest) == reach or np.ptp(errors) <= 1e-12 * np.sum(wanted**2):
        return None
    best = minimize_scalar(off, bounds=(nearest - 1, nearest + 1), method="bounded")
    return float(best.x * interval)


def _table(rows: list[dict[str, Any]]) -> str:
    names = ("velocity_peak", "velocity_median", "pressure_peak", "pressure_median",
             "floor_pressure_median", "level_peak", "fluctuation_peak", "slow_pressure_peak",
             "sound_peak")  # fmt: skip
    header = ("scheme", "start", "Re", "M", "projection", "u %", "median", "p %", "median", "floor",
              "level %", "rest %", "slow p %", "sound %", "steps", "stable", "doubt")  # fmt: skip
    lines = []
    for row in rows:
        cost = row["seconds_per_step"]
        lines.append((
            row["scheme"], row["arrangement"], f"{row['reynolds']:g}", str(row["modes"]),
            row["projection"],
            *(number(row.get(f"{name}_percent")) for name in names),
            number(None if cost is None else cost / row["full_seconds_per_step"]),
            "yes" if row["stable"] else "no", row.get("doubt") or row["judged"] or "none",
        ))  # fmt: skip
    return "errors over the reference points; steps: cost of a step over a full model's\n" + (
        format_rows(header, lines)
    )


if __name__ == "__main__":
    raise SystemExit(main())
