"""Reduced models on reference points at every number of modes, far beyond the time trained on.

    python -m benchmarks.tensor_stability --scale small

The Taylor-Green vortex as in `benchmarks.tensor_rom`, without closure: for M = 1, 2, ... the energy
|a|^2, kinetic plus acoustic, over ten times the time of the training runs, at the ends of the
trained range and at Re = 10000. Full runs are those of `benchmarks.tensor_rom` if it has made them.
"""

from __future__ import annotations

import time as clock
from dataclasses import replace
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxsph import SimulationError
from jaxsph.cli import SCALES, positive_float, positive_int
from jaxsph.environment import environment
from jaxsph_rom.points import mapped_run
from jaxsph_rom.study import full_run

from .measure import progress, tell, write_json
from .reduced_vortex import TRAINED_ON, make_scene, train
from .table import command

REYNOLDS = (100.0, 250.0, 10_000.0)
TIMES_TRAINED = 10


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: a full run failed, 2: bad input."""
    return command(
        "tensor_stability", __doc__, _arguments, _run, argv, json="tensor_stability_{scale}.json"
    )


def _run(options) -> None:
    results = _measured(options)
    write_json(options.json, results)
    worst = max(results["rows"], key=lambda row: row["highest_energy_over_start"] or np.inf)
    stable = sum(row["stable"] for row in results["rows"])
    print(f"{stable} of {len(results['rows'])} runs stable, M = 1 to {options.modes}")
    print(f"highest energy over that at the start: {worst['highest_energy_over_start']:.6f} "
          f"at M = {worst['modes']}, Re = {worst['reynolds']:g}")  # fmt: skip


def _arguments(add) -> None:
    add("--scale", choices=SCALES, default="small", help="size of the runs (default: small)")
    add("--resolution", type=positive_int, metavar="N", help="instead of the scale's")
    add("--end-time", type=positive_float, default=1.0, metavar="T",
        help="of the training runs [s] (default: 1)")  # fmt: skip
    add("--modes", type=positive_int, default=50, metavar="M", help="up to (default: 50)")
    add("--out", type=Path, metavar="DIR",
        help="where runs are kept (default: out/tensor-rom-SCALE)")  # fmt: skip


def _measured(options) -> dict[str, Any]:
    folder = options.out or Path("out", f"tensor-rom-{options.scale}")
    scenes = [make_scene(options, reynolds) for reynolds in TRAINED_ON]
    runs = [full_run(folder / "full", scene, progress) for scene in scenes]
    scene = scenes[0]
    largest = train(scene, runs, options.modes)
    first = mapped_run(largest.reference, runs[0], scene.fluid)[..., 0]
    snapshots = TIMES_TRAINED * (len(runs[0].time) - 1)
    rows = []
    with progress("modes", options.modes) as report:
        for modes in range(1, options.modes + 1):
            flow = largest.truncated(modes)
            start = flow.project(first)
            for reynolds in REYNOLDS:
                rows.append({"modes": modes, "reynolds": reynolds})
                rows[-1] |= _energy(flow, start, reynolds, scene, snapshots)
            report(1)
    tell(f"{snapshots} snapshots each")
    return {
        "rows": rows,
        "trained_on": TRAINED_ON,
        "times_trained": TIMES_TRAINED,
        "particles": runs[0].particles,
        "parameters": scene.parameters,
        "device": jax.devices()[0].device_kind,
        "environment": environment(),
    }


def _energy(flow, start, reynolds: float, scene, snapshots: int) -> dict[str, Any]:
    """Highest and last energy over that at the start, and the run's time."""
    before = clock.perf_counter()
    try:
        schedule = replace(scene.schedule, intervals=snapshots)
        found = flow.predict(start, 1.0 / reynolds, schedule)
    except SimulationError as error:
        return {"stable": False, "fault": str(error), "highest_energy_over_start": None}
    energy = np.asarray(jnp.sum(found**2, axis=1) / jnp.sum(start**2))
    return {
        "stable": True,
        "fault": None,
        "highest_energy_over_start": float(energy.max()),
        "last_energy_over_start": float(energy[-1]),
        "seconds_with_compilation": clock.perf_counter() - before,
    }


if __name__ == "__main__":
    raise SystemExit(main())
