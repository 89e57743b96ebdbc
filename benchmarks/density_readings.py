"""Which reference density was the paper's cavity run with? Energies and floors of both readings.

    python -m benchmarks.density_readings --resolutions 50

The lid-driven cavity at Re 100 by the paper's options over 10 s. The full model does not know its
reference density, a linear equation of state given: a run with 1000 kg/m^3 is that with 1, its
densities and pressures times 1000. The uncentred Euclidean POD of (rho, u) does know it. So one
full run gives both readings: cumulative energies over labels and over reference points, as the
paper prints them, and the floors: errors on the centre line, from 1 s on, of the run's own
projection on M modes. No reduced model in that product is nearer. The paper prints 2, 1 and 1 % in
velocity and 7, 1.5 and 1.5 % in pressure at 10, 20 and 30 modes. Full runs are kept in a folder.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from jaxsph import Trajectory
from jaxsph.arrangements import Lattice
from jaxsph.cli import positive_int
from jaxsph.environment import environment
from jaxsph.metrics import centre_line, probe, relative_discrepancy
from jaxsph.scenes import Scene, lid_driven_cavity
from jaxsph.schemes import DeltaPlus
from jaxsph_rom import Euclidean, ReferenceSpace, cumulative_energy, lagrangian_snapshots, pod
from jaxsph_rom.study import full_run

from .measure import format_rows, number, progress
from .references.source_paper import EXPERIMENTS
from .table import Table, command

KEY = ("resolution", "reference_density", "modes")
REYNOLDS, END_TIME, JUDGED_FROM = 100.0, 10.0, 1.0
DENSITIES, MODES = (1.0, 1000.0), (10, 20, 30)


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: a full run failed, 2: bad input."""
    return command("density_readings", __doc__, _arguments, _run, argv)


def _arguments(add) -> None:
    add("--resolutions", type=positive_int, nargs="+", default=[50], metavar="N",
        help="particles along the cavity (default: 50)")  # fmt: skip
    add("--out", type=Path, default=Path("out/density-readings"), metavar="DIR",
        help="where full runs are kept (default: %(default)s)")  # fmt: skip


def _run(options) -> None:
    kept = Table(options.json, KEY, beside=lambda rows: environment())
    for resolution in options.resolutions:
        cases = [
            {"resolution": resolution, "reference_density": density, "modes": modes}
            for density in DENSITIES for modes in MODES
        ]  # fmt: skip
        wanted = list(kept.left(cases))
        if wanted:
            scene = lid_driven_cavity(
                resolution, REYNOLDS, end_time=END_TIME, arrangement=Lattice(),
                scheme=DeltaPlus(), dtype="float64",
            )  # fmt: skip
            run = full_run(options.out, scene, progress, f"cavity-{resolution}")
            for row in _rows(scene, run, wanted):
                kept.add(row)
    print(_table(kept.rows))


def _rows(scene: Scene, run: Trajectory, wanted: list[dict[str, Any]]):
    reference = ReferenceSpace(scene.state.position, scene.space)
    spaces = {"lagrangian": lagrangian_snapshots(run), "reference": reference.snapshots(run)}
    for density in sorted({case["reference_density"] for case in wanted}):
        ratio = np.asarray([density / float(scene.fluid.reference_density), 1.0, 1.0])
        bases = {
            space: pod(snapshots * ratio[None, :, None], Euclidean(), scene.fluid)
            for space, snapshots in spaces.items()
        }
        energy = {s: cumulative_energy(basis.singular_values) for s, basis in bases.items()}
        modes, whole = bases["reference"].modes, spaces["reference"] * ratio[None, :, None]
        coordinates = np.einsum("gfm,gft->mt", modes[:, :, : max(MODES)], whole)
        truth = _line(scene, run, spaces["reference"])
        for case in wanted:
            if case["reference_density"] != density:
                continue
            count = case["modes"]
            held = np.einsum("gfm,mt->gft", modes[:, :, :count], coordinates[:count])
            found = _line(scene, run, held / ratio[None, :, None])
            late = run.time >= JUDGED_FROM
            row = dict(case)
            for name, wanted_line, line in zip(("velocity", "pressure"), truth, found, strict=True):
                off = relative_discrepancy(wanted_line, line)[late]
                row |= {f"{name}_floor_peak_percent": float(off.max()),
                        f"{name}_floor_median_percent": float(np.median(off))}  # fmt: skip
            paper = EXPERIMENTS["lid-driven-cavity"].energy
            for space, values in energy.items():
                row[f"{space}_energy_left_percent"] = float(100.0 - values[count - 1])
                row[f"{space}_paper_left_percent"] = 100.0 - paper[space][str(count)]
            yield row


def _line(scene: Scene, run: Trajectory, fields) -> tuple[np.ndarray, np.ndarray]:
    """Speed and pressure on the centre line of fields on the reference points."""
    density, velocity = fields[:, 0].T, np.moveaxis(fields[:, 1:], -1, 0)
    places = np.broadcast_to(np.asarray(scene.state.position), velocity.shape)
    pressure = np.asarray(scene.fluid.pressure(density))
    still = Trajectory(run.time, places, velocity, density, pressure)
    return probe(still, centre_line(scene.space), scene.space)


def _table(rows: list[dict[str, Any]]) -> str:
    header = ("cavity", "rho0", "M", "left, labels %", "paper", "left, reference %", "paper",
              "velocity floor %", "pressure floor %")  # fmt: skip
    lines = [
        (
            f"{row['resolution']} x {row['resolution']}",
            f"{row['reference_density']:g}",
            str(row["modes"]),
            *(number(row[f"{space}_{of}_left_percent"], 2)
              for space in ("lagrangian", "reference") for of in ("energy", "paper")),
            *(f"{number(row[f'{name}_floor_peak_percent'], 2)} / "
              f"{number(row[f'{name}_floor_median_percent'], 2)}"
              for name in ("velocity", "pressure")),
        )
        for row in rows
    ]  # fmt: skip
    return format_rows(header, lines)


if __name__ == "__main__":
    raise SystemExit(main())
