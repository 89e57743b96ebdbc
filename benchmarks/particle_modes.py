"""Reduced models on moving particles at any number of modes: errors, pressure's level and waves.

    python -m benchmarks.particle_modes --resolution 50
    python -m benchmarks.particle_modes --scene lid-driven-cavity --train 100 --reynolds 100

The Taylor-Green vortex at a Reynolds number that nothing was trained on, from a lattice or packed
particles, or the lid-driven cavity, in either scheme, by either projection. Errors are those over
the reference points, the pressure's mean and what is left of it apart; a run whose pressure is off
by its own range, or whose particles clump, is named. Beside them stand the floors, which is what
the modes make of the full run. Runs are kept in a folder and finished rows in the JSON file: the
same command goes on.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxsph import Trajectory
from jaxsph.cli import ARRANGEMENTS, positive_float, positive_int
from jaxsph.environment import environment
from jaxsph.metrics import relative_discrepancy
from jaxsph.scenes import SCENES
from jaxsph.schemes import SCHEMES
from jaxsph_rom import (
    AdjointPetrovGalerkin,
    Experiment,
    Galerkin,
    LatticePolynomials,
    LocalSplines,
    OnParticles,
    Study,
)
from jaxsph_rom.study import doubt, level_and_fluctuation

from .measure import format_rows, number, progress, tell
from .table import Table, command

INTERPOLATIONS = {"splines": LocalSplines, "polynomials": LatticePolynomials}
KEY = ("scheme", "arrangement", "modes", "projection")
MODES = (1, 2, 3, 4, 5, 6, 8, 10, 12, 15, 20, 30, 40, 50)
PROJECTIONS = {"galerkin": Galerkin(), "apg": AdjointPetrovGalerkin(1e-4)}


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: a full run failed, 2: bad input."""
    json = "particle_modes_{scene}_{resolution}.json"
    return command("particle_modes", __doc__, _arguments, _run, argv, json=json)


def _arguments(add) -> None:
    add("--scene", choices=("taylor-green", "lid-driven-cavity"), default="taylor-green",
        help="default: %(default)s")  # fmt: skip
    add("--interpolation", choices=tuple(INTERPOLATIONS), default="splines",
        help="of modes at moving particles (default: %(default)s)")  # fmt: skip
    add("--judged-from", type=float, default=0.0, metavar="T",
        help="time from which on errors count [s] (default: 0)")  # fmt: skip
    add("--resolution", type=positive_int, default=50, metavar="N", help="default: %(default)s")
    add("--end-time", type=positive_float, default=1.0, metavar="T", help="[s] (default: 1)")
    add("--train", type=positive_float, nargs="+", default=[110.0, 160.0, 230.0], metavar="RE",
        help="default: 110 160 230")  # fmt: skip
    add("--reynolds", type=positive_float, default=137.0, metavar="RE", help="default: 137")
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
    names = ("scene", "interpolation", "judged_from", "resolution", "end_time", "train",
             "reynolds")  # fmt: skip
    kept = Table(options.json, KEY, settings={name: getattr(options, name) for name in names})
    kept.results |= {"environment": environment(), "device": jax.devices()[0].device_kind}
    for scheme in options.schemes:
        for arrangement in options.arrangements:
            truth = None
            for modes in options.modes:
                left = [
                    name
                    for name in options.projections
                    if not kept.has((scheme, arrangement, modes, name))
                ]
                if not left:
                    tell(f"done before: {scheme}, {arrangement}, M = {modes}")
                    continue
                study = _study(options, scheme, arrangement, left)
                experiment = Experiment(tuple(options.train), (options.reynolds,), (modes,))
                for outcome in study.run(experiment):
                    truth = truth or _Truth(study, experiment, options.judged_from)
                    case = {"scheme": scheme, "arrangement": arrangement, "modes": modes,
                            "projection": outcome.case.projection}  # fmt: skip
                    kept.add(case | truth.row(outcome, modes))
    print(_table(kept.rows))


def _study(options, scheme: str, arrangement: str, names: list[str]) -> Study:
    folder = options.out or Path("out", f"particle-modes-{options.scene}-{options.resolution}")

    def make(reynolds: float):
        return SCENES[options.scene](
            options.resolution,
            reynolds,
            end_time=options.end_time,
            arrangement=ARRANGEMENTS[arrangement](seed=0),
            scheme=SCHEMES[scheme],
            dtype="float64",
        )

    method = OnParticles(
        tuple(PROJECTIONS[name] for name in names),
        interpolation=INTERPOLATIONS[options.interpolation],
    )
    return Study(make, folder / f"{scheme}-{arrangement}", method, progress=progress)


class _Truth:
    """The full run on the reference points."""

    def __init__(self, study: Study, experiment: Experiment, judged_from: float):
        (self.reynolds,) = experiment.reynolds
        runs, (method,) = study.runs, study.methods
        self.scene, self.full = runs.scene(self.reynolds), runs.full(self.reynolds)
        self.reference = runs.reference(experiment.trained_on[0], method.rule)
        self.basis = method.basis(runs, experiment)
        self.snapshots = self.reference.snapshots(self.full)
        self.counted = self.full.time >= judged_from

    def row(self, outcome, modes: int) -> dict[str, Any]:
        """Errors of a run and of the projection of the full one, and what it cost."""
        run: Trajectory = outcome.trajectory
        found = self.reference.snapshots(run)
        basis = self.basis.truncated(modes)
        centred = self.snapshots - basis.centre[:, :, None]
        weighted = basis.modes * basis.weights[None, :, None]
        coordinates = np.einsum("gfm,gft->mt", weighted, centred)
        floor = np.einsum("gfm,mt->gft", basis.modes, coordinates) + basis.centre[:, :, None]
        errors = self._errors(found, "") | self._errors(floor[:, :, : len(run.time)], "floor_")
        fluctuation = level_and_fluctuation(*self._pressures(found))[1]
        counted, case = self.counted[: len(run.time)], outcome.case
        return errors | {
            "stable": case.stable,
            "fault": case.fault,
            "doubt": doubt(run, self.scene, run.time[counted], fluctuation[counted]),
            "seconds_per_step": case.rom_seconds and case.rom_seconds / case.rom_steps,
            "full_seconds_per_step": case.fom_seconds / case.fom_steps,
        }

    def _pressures(self, found) -> list[np.ndarray]:
        count = found.shape[2]
        fields = (self.snapshots[:, 0, :count], found[:, 0])
        return [np.asarray(self.scene.fluid.pressure(jnp.asarray(density.T))) for density in fields]

    def _errors(self, found, prefix: str) -> dict[str, float]:
        speeds = [
            np.linalg.norm(fields[:, 1:, : found.shape[2]], axis=1).T
            for fields in (self.snapshots, found)
        ]
        pressures = self._pressures(found)
        level, fluctuation = level_and_fluctuation(*pressures)
        parts = {
            "velocity": relative_discrepancy(*speeds),
            "pressure": relative_discrepancy(*pressures),
            "level": level,
            "fluctuation": fluctuation,
        }
        return {
            f"{prefix}{name}_{what}_percent": float(of(percent[self.counted[: len(percent)]]))
            for name, percent in parts.items()
            for what, of in (("peak", np.max), ("median", np.median))
        }


def _table(rows: list[dict[str, Any]]) -> str:
    names = ("velocity_peak", "velocity_median", "pressure_peak", "pressure_median",
             "floor_pressure_median", "level_peak", "fluctuation_peak")  # fmt: skip
    header = ("scheme", "start", "M", "projection", "u %", "median", "p %", "median", "floor",
              "level %", "rest %", "steps", "stable", "doubt")  # fmt: skip
    lines = []
    for row in rows:
        cost = row["seconds_per_step"]
        lines.append((
            row["scheme"], row["arrangement"], str(row["modes"]), row["projection"],
            *(number(row[f"{name}_percent"]) for name in names),
            number(None if cost is None else cost / row["full_seconds_per_step"]),
            "yes" if row["stable"] else "no", row["doubt"] or "none",
        ))  # fmt: skip
    return "errors over the reference points; steps: cost of a step over a full model's\n" + (
        format_rows(header, lines)
    )


if __name__ == "__main__":
    raise SystemExit(main())
