"""Carrying modes to moving particles: splines and polynomials, error beside time.

    python -m benchmarks.mode_interpolation

The lid-driven cavity, whose particles start on a lattice: modes of a full run are carried from the
reference points to the particles of its later snapshots. Error: of velocity and density there,
beside what the particles had, with the coordinates of the snapshot's projection. Time: of one
evaluation of all modes, compiled, in turns. The full run is that of `benchmarks.paper_rom` if it
has made it.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from jaxsph.cli import positive_float, positive_int
from jaxsph.environment import environment
from jaxsph.interpolation import MovingLeastSquaresMap
from jaxsph.scenes import lid_driven_cavity
from jaxsph.schemes import DeltaPlus
from jaxsph_rom import Energy, LatticePolynomials, LocalSplines, ReferenceSpace, pod
from jaxsph_rom.study import full_run

from .measure import alternate, format_rows, number, progress, summary, write_json
from .table import command

REYNOLDS = 100.0
RULES = tuple((LocalSplines, k) for k in (1, 3, 5)) + tuple(
    (LatticePolynomials, k) for k in (1, 3, 5)
)
_REPEATS = 20
_JUDGED = 10  # snapshots


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: the full run failed, 2: bad input."""
    return command("mode_interpolation", __doc__, _arguments, _run, argv)


def _run(options) -> None:
    results = _measured(options)
    write_json(options.json, results)
    print(_table(results))


def _arguments(add) -> None:
    add("--resolution", type=positive_int, metavar="N", help="instead of the small scale's")
    add("--end-time", type=positive_float, default=10.0, metavar="T", help="[s] (default: 10)")
    add("--modes", type=positive_int, nargs="+", default=[10, 30], metavar="M",
        help="default: 10 30")  # fmt: skip
    add("--out", type=Path, default=Path("out/paper-rom-lid-driven-cavity-small"), metavar="DIR",
        help="where the run is kept (default: %(default)s)")  # fmt: skip


def _measured(options) -> dict[str, Any]:
    scene = lid_driven_cavity(
        options.resolution, REYNOLDS, end_time=options.end_time, scheme=DeltaPlus(),
        dtype="float64",
    )
    run = full_run(options.out / "full", scene, progress)
    space, points = scene.space, np.asarray(scene.state.position)
    snapshots = ReferenceSpace(points, space, MovingLeastSquaresMap).snapshots(run)
    judged = np.linspace(0, len(run.time) - 1, _JUDGED + 1).astype(int)[1:]
    rows = []
    for modes in options.modes:
        basis = pod(snapshots, Energy(), scene.fluid, modes)
        values = basis.functions.reshape(len(points), -1)
        made = {rule: rule[0].fit(points, values, space, rule[1]) for rule in RULES}
        places = jnp.asarray(run.position[judged[-1]])
        calls = {rule: partial(_waited_for, made[rule], places) for rule in RULES}
        seconds, _ = alternate(calls, _REPEATS)
        for rule in RULES:
            rows.append(
                {"interpolation": rule[0].__name__, "order": rule[1], "modes": modes}
                | _errors(made[rule], basis, snapshots, run, judged)
                | {"seconds": summary(seconds[rule])}
            )
    return {
        "rows": rows,
        "particles": run.particles,
        "parameters": scene.parameters,
        "device": jax.devices()[0].device_kind,
        "environment": environment(),
    }


def _waited_for(interpolation, places):
    return jax.block_until_ready(_evaluated(interpolation, places))


@eqx.filter_jit
def _evaluated(interpolation, places):
    return interpolation(places)


def _errors(interpolation, basis, snapshots, run, judged) -> dict[str, float]:
    """Relative errors of velocity, and of density over its fluctuation, at the particles."""
    weighted = basis.modes * basis.weights[None, :, None]
    apart = {"velocity": [], "density": []}
    for k in judged:
        coordinates = np.einsum("gfm,gf->m", weighted, snapshots[:, :, k] - basis.centre)
        functions = _evaluated(interpolation, jnp.asarray(run.position[k]))
        carried = np.asarray(functions).reshape(run.particles, basis.modes.shape[1], -1)
        modes, centre = basis.parts(carried)
        fields = np.asarray(centre + modes @ coordinates)
        density, velocity = run.density[k], run.velocity[k]
        apart["velocity"].append(_relative(fields[:, 1:], velocity))
        rest = float(basis.centre[:, 0].mean())
        apart["density"].append(_relative(fields[:, 0] - rest, density - rest))
    return {f"{name}_percent": float(np.median(values)) for name, values in apart.items()}


def _relative(found: np.ndarray, wanted: np.ndarray) -> float:
    return 100.0 * float(np.linalg.norm(found - wanted) / np.linalg.norm(wanted))


def _table(results: dict[str, Any]) -> str:
    header = ("M", "interpolation", "order", "velocity %", "density %", "ms")
    rows = [
        (
            str(row["modes"]), row["interpolation"], str(row["order"]),
            number(row["velocity_percent"], 4), number(row["density_percent"], 4),
            number(1e3 * row["seconds"]["median"]),
        )
        for row in results["rows"]
    ]  # fmt: skip
    text = f"at {results['particles']} particles, median over snapshots\n"
    return text + format_rows(header, rows)


if __name__ == "__main__":
    raise SystemExit(main())
