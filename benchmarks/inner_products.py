"""Inner products, centring and a low-pass of the snapshots, compared on velocity and pressure.

    python -m benchmarks.inner_products --scale small

The Taylor-Green vortex at Re 100 from stirred particles and a balanced start, reconstructed by
Galerkin systems on reference points without closure. Block bases have M // 2 modes of density and
the rest of velocity; they are the same in either product. Runs are kept in a folder, which
`benchmarks.tensor_rom` shares, and finished rows in the JSON file: the same command goes on.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any

import jax
import numpy as np

from jaxsph.arrangements import Lattice
from jaxsph.cli import SCALES, positive_float, positive_int
from jaxsph.environment import environment
from jaxsph.interpolation import MovingLeastSquaresMap
from jaxsph.scenes import Scene
from jaxsph_rom import (
    Basis,
    Energy,
    Euclidean,
    MeanCentred,
    ReferenceSpace,
    RestCentred,
    Uncentred,
    block_pod,
    low_pass,
    pod,
)
from jaxsph_rom.points import ReducedFlow, galerkin_system, mapped_run
from jaxsph_rom.study import full_run

from .measure import format_rows, number, progress, tell
from .reduced_vortex import judged, make_scene, profile_of
from .table import Table, command

REYNOLDS = 100.0
PRODUCTS = {"euclidean": Euclidean(), "energy": Energy(), "block-energy": Energy()}
CENTRINGS = {"uncentred": Uncentred(), "rest": RestCentred(), "mean": MeanCentred()}
KEY = ("product", "centring", "cutoff", "modes")


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: the full run failed, 2: bad input."""
    return command(
        "inner_products", __doc__, _arguments, _run, argv, json="inner_products_{scale}.json"
    )


def _arguments(add) -> None:
    add("--scale", choices=SCALES, default="small", help="size of the run (default: small)")
    add("--resolution", type=positive_int, metavar="N", help="instead of the scale's")
    add("--end-time", type=positive_float, default=1.0, metavar="T", help="[s] (default: 1)")
    add("--modes", type=positive_int, nargs="+", default=[5, 10, 20, 40], metavar="M",
        help="numbers of modes, two or more (default: 5 10 20 40)")  # fmt: skip
    add("--cutoff", type=positive_float, metavar="F",
        help="of the low-pass [Hz] (default: c0 / 2 L)")  # fmt: skip
    add("--out", type=Path, metavar="DIR",
        help="where the run is kept (default: out/tensor-rom-SCALE)")  # fmt: skip


def _run(options) -> None:
    settings = {
        name: getattr(options, name) for name in ("scale", "resolution", "end_time", "cutoff")
    }
    kept = Table(options.json, KEY, settings=settings)
    scene = make_scene(options, REYNOLDS)
    cutoff = options.cutoff or float(scene.fluid.sound_speed) / (2 * max(scene.space.box.lengths))
    groups = list(product(PRODUCTS, CENTRINGS, (None, cutoff)))
    left = [g for g in groups if not all(kept.has((*g, modes)) for modes in options.modes)]
    if not left:
        tell("all done before")
        return print(_table(kept.results))
    folder = options.out or Path("out", f"tensor-rom-{options.scale}")
    run = full_run(folder / "full", scene, progress)
    reference = ReferenceSpace(Lattice().positions(scene.space), scene.space, MovingLeastSquaresMap)
    mapped = mapped_run(reference, run, scene.fluid)
    smooth = low_pass(mapped, run.time, cutoff)
    truth = profile_of(scene, run)
    kept.results |= {
        "reynolds": REYNOLDS,
        "particles": run.particles,
        "snapshots": len(run.time),
        "parameters": scene.parameters,
        "device": jax.devices()[0].device_kind,
        "environment": environment(),
    }
    with progress("bases", len(left)) as report:
        for name, centring, filtered in left:
            snapshots = mapped if filtered is None else smooth
            for modes, flow in _flows(scene, reference, snapshots, name, centring, options.modes):
                key = (name, centring, filtered, modes)
                if not kept.has(key):
                    projected = np.asarray(flow.project(mapped))  # from where the full run starts
                    row = dict(zip(KEY, key, strict=True))
                    kept.add(row | judged(flow, scene, run, projected, truth))
            report(1)
    print(_table(kept.results))


def _flows(
    scene: Scene, reference: ReferenceSpace, snapshots, name: str, centring: str, modes: list[int]
) -> Iterator[tuple[int, ReducedFlow]]:
    """A reduced flow for each number of modes."""
    arguments = (snapshots, PRODUCTS[name], scene.fluid)
    rule = CENTRINGS[centring]

    def projected(basis: Basis) -> ReducedFlow:
        system = galerkin_system(scene, basis, reference.points)
        return ReducedFlow(reference, basis, system, scene.fluid)

    if name == "block-energy":
        for m in modes:
            yield m, projected(block_pod(*arguments, (m // 2, m - m // 2), rule))
    else:
        largest = projected(pod(*arguments, max(modes), rule))
        for m in modes:
            yield m, largest.truncated(m)


def _table(results: dict[str, Any]) -> str:
    header = ("product", "centring", "cutoff", "M", "velocity %", "median", "floor", "pressure %",
              "median", "floor", "median", "reduced ms", "stable")  # fmt: skip
    rows = []
    for row in results["rows"]:
        seconds = row["rom_seconds"]["median"]
        rows.append((
            row["product"], row["centring"], number(row["cutoff"]), str(row["modes"]),
            *(number(row.get(name)) for name in (
                "velocity_peak_percent", "velocity_median_percent", "floor_velocity_peak_percent",
                "pressure_peak_percent", "pressure_median_percent", "floor_pressure_peak_percent",
                "floor_pressure_median_percent")),
            number(None if seconds is None else 1e3 * seconds), "yes" if row["stable"] else "no",
        ))  # fmt: skip
    return f"peak discrepancy on the centre line, {results['particles']} particles\n" + format_rows(
        header, rows
    )


if __name__ == "__main__":
    raise SystemExit(main())
