"""Reduced models of families of scenes: true errors beside floors and the expected error.

    python -m benchmarks.families

Each family is trained on a few points and judged at unseen ones, every third of which lies outside
the training range: the error of velocity over all points and times, relative to the largest
velocity in its norm, that of the projection alone, and what the model itself expects
(`Prediction.error_indicator`). Models are kept in a folder, results as they come: the same command
goes on where it was cut short.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jax
import numpy as np
from scipy.stats import spearmanr

import jaxsph_rom
from jaxsph import SimulationError, run_scene
from jaxsph.cli import fail, positive_float, positive_int, report_errors
from jaxsph.environment import environment
from jaxsph.io import check_target
from jaxsph.scenes import Scene
from jaxsph_rom.points import mapped_run
from jaxsph_rom.points.prediction.indicator import velocity_error

from .family_scenes import CASES
from .measure import format_rows, number, progress, read_json, tell, write_json

_SEED = 1
_BEYOND = 0.2  # of the range, on either side: how far unseen points go


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: a full run failed, 2: bad input."""
    return report_errors("families", _command, argv)


def _command(argv) -> int:
    options = _parser().parse_args(argv)
    check_target(options.json, overwrite=True)
    settings = {"resolution": options.resolution, "end_time": options.end_time}
    results = read_json(options.json) or {}
    if results.get("settings") != settings:
        results = {"settings": settings, "rows": []}
    results |= {"device": jax.devices()[0].device_kind, "environment": environment()}
    with jax.enable_x64(True):
        try:
            for name in options.cases:
                _judge(name, settings, options, results)
        except SimulationError as error:
            return fail("families", f"full model: {error}", 1)
    results["summary"] = {
        name: _summary([row for row in results["rows"] if row["case"] == name])
        for name in dict.fromkeys(row["case"] for row in results["rows"])
    }
    write_json(options.json, results)
    print(_table(results))
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        "python -m benchmarks.families", description=__doc__.splitlines()[0]
    )
    add = parser.add_argument
    add("--cases", choices=tuple(CASES), nargs="+", default=list(CASES), help="default: all")
    add("--resolution", type=positive_int, default=24, metavar="N", help="default: 24")
    add("--end-time", type=positive_float, default=1.0, metavar="T", help="[s] (default: 1)")
    add("--unseen", type=positive_int, default=20, metavar="K",
        help="points to be judged at (default: 20)")  # fmt: skip
    add("--out", type=Path, default=Path("out/families"), metavar="DIR",
        help="where models are kept (default: %(default)s)")  # fmt: skip
    add("--json", type=Path, default=Path("benchmarks/results/families.json"), metavar="FILE",
        help="default: %(default)s")  # fmt: skip
    return parser


def unseen(points: list[dict[str, float]], count: int) -> list[dict[str, float]]:
    """Random points in the training range and somewhat beyond, every third of these outside."""
    names = list(points[0])
    table = np.array([[point[name] for name in names] for point in points])
    low, high = table.min(axis=0), table.max(axis=0)
    draw, found = np.random.default_rng(_SEED), []
    while len(found) < count:
        point = low + (high - low) * draw.uniform(-_BEYOND, 1.0 + _BEYOND, len(names))
        outside = bool(((point < low) | (point > high)).any())
        if outside == (len(found) % 3 == 2):
            found.append(dict(zip(names, map(float, point), strict=True)))
    return found


def _judge(name: str, settings: Mapping[str, Any], options, results: dict[str, Any]) -> None:
    case = CASES[name]

    def make(**parameters):
        return case.make(**parameters, **settings)

    done = [row["parameters"] for row in results["rows"] if row["case"] == name]
    left = [point for point in unseen(case.points, options.unseen) if point not in done]
    if not left:
        return
    label = f"{name}-{settings['resolution']}-{settings['end_time']:g}"
    path = options.out / f"{label}.h5"
    if path.exists():
        trained = jaxsph_rom.load(path)
    else:
        tell(f"training: {name}")
        trained = jaxsph_rom.train(
            make, case.points, case.modes, closure=case.closure, progress=progress
        )
        trained.save(path)
    for point in left:
        scene = make(**point)
        with progress(f"{name}, full model", scene.steps) as report:
            full = run_scene(scene, progress=report)
        row = {"case": name, "parameters": point, **_row(trained, point, scene, full)}
        results["rows"].append(row)
        write_json(options.json, results)


def _row(trained: jaxsph_rom.TrainedModel, point, scene: Scene, full) -> dict[str, Any]:
    """Errors of one member, and how its time compares."""
    prediction = trained.predict(point)
    mapped = mapped_run(trained.flow.reference, full, scene.fluid)
    projected = np.asarray(trained.flow.project(mapped))
    stable = int(prediction.status[0]) == 0
    coordinates = prediction.coordinates[0]
    return {
        "outside": bool(prediction.outside[0]),
        "stable": stable,
        "error": velocity_error(trained.flow, coordinates, mapped[:, 1:]) if stable else None,
        "floor": velocity_error(trained.flow, projected, mapped[:, 1:]),
        "expected": float(prediction.error_indicator[0]) if stable else None,
        "start": prediction.start,
        "full_seconds": full.metadata["run_seconds"],
        "reduced_seconds": prediction.run_seconds,
    }


def _summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Errors of members inside and outside, and how well these were expected."""
    errors, expected = (np.array([row[n] for row in rows], float) for n in ("error", "expected"))
    good = np.isfinite(errors) & np.isfinite(expected)
    inside = np.array([not row["outside"] for row in rows])
    ratio = expected[good] / errors[good]
    return {
        "members": len(rows),
        "lost": int((~good).sum()),
        "median_error_inside": float(np.median(errors[good & inside])),
        "median_floor_inside": float(
            np.median([row["floor"] for row, kept in zip(rows, inside, strict=True) if kept])
        ),
        "largest_error_inside": float(errors[good & inside].max()),
        "rank_correlation": float(spearmanr(errors[good], expected[good]).statistic),
        "expected_over_true": [float(q) for q in np.quantile(ratio, (0.1, 0.5, 0.9))],
    }


def _table(results: dict[str, Any]) -> str:
    header = ("family", "unseen", "error %", "floor %", "largest %", "rank correlation",
              "expected / true", "10 %", "90 %")  # fmt: skip
    rows = []
    for name, found in results["summary"].items():
        low, middle, high = found["expected_over_true"]
        percent = (100.0 * found[f"{kind}_inside"]
                   for kind in ("median_error", "median_floor", "largest_error"))  # fmt: skip
        values = (*percent, found["rank_correlation"], middle, low, high)
        rows.append((name, str(found["members"]), *map(number, values)))
    return format_rows(header, rows)


if __name__ == "__main__":
    raise SystemExit(main())
