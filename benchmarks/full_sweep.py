"""A sweep of full models over devices, against each model alone: deviations, and time.

    python -m benchmarks.full_sweep

64 Taylor-Green vortices of 2,500 particles, Re = 100 to 400, each with particles of its own seed,
on eight devices that share this machine's cores. The largest deviation of a member from its single
run, relative to the field's largest value, must be round-off.
"""

from __future__ import annotations

import time as clock
from pathlib import Path
from typing import Any

import jax
import numpy as np

from jaxsph import run_scene
from jaxsph.arrangements import JitteredLattice
from jaxsph.cli import positive_float, positive_int
from jaxsph.environment import environment
from jaxsph.scenes import Scene, taylor_green
from jaxsph.schemes import DeltaPlus
from jaxsph.sweeps import read_member, sweep

from .measure import format_rows, number, progress, write_json
from .table import command

_FIELDS = ("position", "velocity", "density", "pressure")


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 2: bad input."""
    return command("full_sweep", __doc__, _arguments, _run, argv)


def _arguments(add) -> None:
    add("--members", type=positive_int, default=64, metavar="K", help="default: %(default)s")
    add("--side", type=positive_int, default=50, metavar="N", help="default: %(default)s")
    add("--end-time", type=positive_float, default=0.1, metavar="T", help="[s] (default: 0.1)")
    add("--devices", type=positive_int, default=8, metavar="D", help="default: %(default)s")
    add("--out", type=Path, default=Path("out/full-sweep/sweep.h5"), metavar="FILE",
        help="of the sweep; a killed one goes on (default: %(default)s)")  # fmt: skip


def _run(options) -> None:
    if options.devices > 1:
        jax.config.update("jax_num_cpu_devices", options.devices)
    found = measured(members(options.members, options.side, options.end_time), options.out)
    write_json(options.json, found | {"environment": environment()})
    print(format_rows(("quantity", "value"), [(k, number(v)) for k, v in found.items()]))


def members(count: int, side: int, end_time: float) -> list[Scene]:
    """Scenes at even Reynolds numbers and seeds of their own."""
    return [
        taylor_green(
            side, reynolds, end_time=end_time, arrangement=JitteredLattice(seed=seed),
            scheme=DeltaPlus(),
        )
        for seed, reynolds in enumerate(np.linspace(100.0, 400.0, count).tolist())
    ]


def measured(scenes: list[Scene], path: Path) -> dict[str, Any]:
    """The sweep, then each scene alone."""
    before = clock.perf_counter()
    with progress("sweep", len(scenes)) as report:
        status = sweep(scenes, path, progress=report)
    sweep_seconds = clock.perf_counter() - before
    largest, alone, compiling = dict.fromkeys(_FIELDS, 0.0), 0.0, 0.0
    with progress("alone", len(scenes)) as report:
        for k, scene in enumerate(scenes):
            single, member = run_scene(scene), read_member(path, k)
            alone += single.timing.run_seconds
            compiling += single.timing.compile_seconds
            for name in _FIELDS:
                one, other = getattr(single, name), getattr(member, name)
                apart = float(np.abs(one - other).max() / np.abs(one).max())
                largest[name] = max(largest[name], apart)
            report(1)
    return {
        "members": len(scenes),
        "lost": int((status.code != 0).sum()),
        "particles": scenes[0].state.density.shape[0],
        "steps": scenes[0].steps,
        "devices": jax.device_count(),
        "sweep_seconds_with_compilation": sweep_seconds,
        "alone_seconds": alone,
        "alone_compile_seconds": compiling,
        **{f"largest_deviation_{name}": value for name, value in largest.items()},
    }


if __name__ == "__main__":
    raise SystemExit(main())
