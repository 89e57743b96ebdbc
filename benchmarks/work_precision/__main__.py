"""Error against run time: which setting is cheapest for a wanted accuracy.

    python -m benchmarks.work_precision
    python -m benchmarks.work_precision taylor-green --quick

Full models over resolution, h/dx, step, kernel, precision, density diffusion, shifting and Mach
number; reduced models over modes, projection, memory length, inner product, map, interpolation,
formulation, closure and hyper-reduction. Relative L2 errors against the exact solution of the
Taylor-Green vortex and against a converged spectral solution of the lid-driven cavity. Every
setting is in the JSON file once it is done: the same command goes on where it was cut short. A
setting that blows up is recorded with its fault. What users ask by `jaxsph-rom advise` is written
from these measurements.
"""

from __future__ import annotations

import argparse
import dataclasses
from pathlib import Path
from typing import Any

import jax

from jaxsph import SimulationError
from jaxsph.environment import environment
from jaxsph.io import check_target
from jaxsph_rom import advice
from jaxsph_rom.report.plain import plain

from ..measure import progress, read_json, tell, write_json
from ..table import command
from .full import run_full
from .reduced import run_reduced
from .report import PRESSURE, VELOCITY, figure, seconds_of, sound_rows, tables
from .settings import FULL, GRIDS, QUICK, Case, Grid, Setting, named


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 2: bad input."""
    return command(
        "work_precision", __doc__, _arguments, _run, argv, json="work_precision_{kind}.json"
    )


def _run(options) -> None:
    quick = options.kind == "quick"
    grids = QUICK if quick else GRIDS
    table = options.advice or (None if quick else advice.TABLE)
    if table is not None:
        check_target(table)
    folder = options.out or Path("out", f"work-precision-{options.kind}")
    results = _started(options.json)
    for name in dict.fromkeys(options.scenes or grids):
        run_scene(name, grids[name], results, options.json, folder)
        case, rows = (results["scenes"][name][part] for part in ("case", "rows"))
        print(tables(name, rows))
        image = _image(options.figure, name, quick)
        if image is not None:
            figure(name, rows, case, image)
            print(f"figure: {image}")
    if table is not None:
        write_json(table, compact(results, options.kind))
        print(f"table of jaxsph-rom advise: {table}")


def _arguments(add) -> None:
    add("scenes", nargs="*", type=_scene, metavar="SCENE",
        help=f"of {', '.join(GRIDS)} (default: all)")  # fmt: skip
    add("--quick", action="store_const", const="quick", default="full", dest="kind",
        help="a few settings at a tiny size, in some three minutes")  # fmt: skip
    add("--out", type=Path, metavar="DIR",
        help="where training runs are kept (default: out/work-precision-KIND)")  # fmt: skip
    add("--figure", type=Path, metavar="FILE",
        help="one for each scene, its name added before the ending (default: "
        "docs/figures/work_precision.png; none with --quick)")  # fmt: skip
    add("--advice", type=Path, metavar="FILE",
        help="table of `jaxsph-rom advise` (default: the package's own; none with "
        "--quick)")  # fmt: skip


def _scene(text: str) -> str:
    if text not in GRIDS:
        raise argparse.ArgumentTypeError(f"one of {', '.join(GRIDS)}, got {text!r}")
    return text


def _started(path: Path) -> dict[str, Any]:
    """The results so far.

    Raises:
        ValueError: if the file holds something else, or times of another machine.
    """
    found = read_json(path)
    if found is None:
        return {"scenes": {}, "environment": environment()}
    if "scenes" not in found or "environment" not in found:
        raise ValueError(f"{path}: holds other results; name another file with --json.")
    here = plain(environment())
    if any(found["environment"][part] != here[part] for part in ("machine", "device")):
        raise ValueError(f"{path}: holds times of another machine; name another file with --json.")
    return found


def run_scene(
    name: str, grid: Grid, results: dict[str, Any], path: Path, folder: Path
) -> list[dict[str, Any]]:
    """Run what is not in the results yet, and write these after every setting.

    Raises:
        ValueError: if the results are of another case of the scene.
    """
    case = plain(dataclasses.asdict(grid.case))
    held = results["scenes"].setdefault(name, {"case": case, "rows": []})
    if held["case"] != case:
        raise ValueError(f"{path}: holds another case of {name}; name another file with --json.")
    rows = held["rows"]
    done = [(row["family"], row["settings"]) for row in rows]
    left = [s for s in grid.settings if (s.family, plain(dataclasses.asdict(s))) not in done]
    if not left:
        tell(f"{name}: all done before")
    with progress(name, len(grid.settings), len(grid.settings) - len(left)) as report:
        for setting in left:
            jax.clear_caches()  # each compiles its own; a process has room for so many programs
            rows.append(measured(name, grid.case, setting, folder))
            results["environment"] = environment()
            write_json(path, results)
            report(1)
    return rows


def measured(name: str, case: Case, setting: Setting, folder: Path) -> dict[str, Any]:
    """A row: what was run, and its errors and times or its fault."""
    row = {"family": setting.family, "label": named(setting)}
    row |= {"settings": plain(dataclasses.asdict(setting)), "fault": None}
    run = run_full if setting.family == FULL else run_reduced
    try:
        row |= run(name, case, setting, folder)
    except (SimulationError, ValueError) as error:
        row |= {"fault": str(error)}
    if row["fault"] is not None:
        tell(f"failed: {row['family']}, {row['label']}: {row['fault']}")
    return plain(row)


def compact(results: dict[str, Any], kind: str) -> dict[str, Any]:
    """The table that `jaxsph-rom advise` reads; `kind` names the grid, full or quick."""
    scenes = {
        name: {
            "reynolds": held["case"]["reynolds"],
            "end_time": held["case"]["end_time"],
            "reference": held["case"]["reference"],
            "rows": [
                {
                    "family": row["family"],
                    "label": row["label"],
                    "velocity_percent": row[VELOCITY],
                    "pressure_percent": row[PRESSURE],
                    "seconds": seconds_of(row),
                    "compile_seconds": row["compile_seconds"],
                    "offline_seconds": row["offline_seconds"],
                    "command": row["command"],
                }
                for row in sound_rows(held["rows"])
            ],
        }
        for name, held in results["scenes"].items()
    }
    return {
        "grid": kind,
        "scenes": scenes,
        **{k: results["environment"][k] for k in ("machine", "versions")},
    }


def _image(given: Path | None, name: str, quick: bool) -> Path | None:
    if given is None and quick:
        return None
    path = given or Path("docs", "figures", "work_precision.png")
    return path.with_name(f"{path.stem}_{name.replace('-', '_')}{path.suffix}")


if __name__ == "__main__":
    raise SystemExit(main())
