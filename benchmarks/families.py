"""Reduced models of families of scenes: true errors beside floors and the expected error.

    python -m benchmarks.families

Each family is trained on a few points and judged at unseen ones, every third of which lies outside
the training range: the error of velocity over all points and times, relative to the largest
velocity in its norm, that of the projection alone, and what the model itself expects
(`Prediction.error_indicator`). Models are kept in a folder, results as they come: the same command
goes on where it was cut short.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jax
import numpy as np
from scipy.stats import spearmanr

import jaxsph_rom
from jaxsph import run_scene
from jaxsph.cli import positive_float, positive_int
from jaxsph.environment import environment
from jaxsph.io import check_target
from jaxsph.scenes import Scene
from jaxsph_rom.points import mapped_run
from jaxsph_rom.points.prediction.indicator import velocity_error

from .family_scenes import CASES
from .measure import format_rows, number, progress, tell
from .table import Table, command

_SEED = 1
_BEYOND = 0.2  # of the range, on either side: how far unseen points go


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: a full run failed, 2: bad input."""
    return command("families", __doc__, _arguments, _judge_all, argv)


def _arguments(add) -> None:
    add("--cases", choices=tuple(CASES), nargs="+", default=list(CASES), help="default: all")
    add("--resolution", type=positive_int, default=24, metavar="N", help="default: 24")
    add("--end-time", type=positive_float, default=1.0, metavar="T", help="[s] (default: 1)")
    add("--unseen", type=positive_int, default=20, metavar="K",
        help="points to be judged at (default: 20)")  # fmt: skip
    add("--out", type=Path, default=Path("out/families"), metavar="DIR",
        help="where models are kept (default: %(default)s)")  # fmt: skip
    add("--page", type=Path, default=Path("docs/measured/families.md"), metavar="FILE",
        help="table as a page (default: %(default)s)")  # fmt: skip


def _judge_all(options) -> None:
    check_target(options.page, overwrite=True)
    settings = {"resolution": options.resolution, "end_time": options.end_time}
    training: dict[str, Any] = {}

    def beside(rows):
        names = dict.fromkeys(row["case"] for row in rows)
        of = {name: [row for row in rows if row["case"] == name] for name in names}
        summary = {name: _summary(of[name], training[name]) for name in names}
        return {"training": training, "summary": summary}

    table = Table(options.json, ("case", "parameters"), settings, beside)
    training |= table.results.get("training", {})
    table.results |= {"device": jax.devices()[0].device_kind, "environment": environment()}
    for name in options.cases:
        _judge(name, settings, options, table, training)
    table.write()
    options.page.write_text(page(table.results), encoding="utf-8")
    print(format_rows(*_table(table.results)))


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


def _judge(name: str, settings: Mapping[str, Any], options, table: Table, training) -> None:
    case = CASES[name]

    def make(**parameters):
        return case.make(**parameters, **settings)

    path = options.out / f"{name}-{settings['resolution']}-{settings['end_time']:g}.h5"
    if path.exists():
        trained = jaxsph_rom.load(path)
    else:
        tell(f"training: {name}")
        trained = jaxsph_rom.train(
            make, case.points, case.modes, closure=case.closure, progress=progress
        )
        trained.save(path)
    training[name] = _training_seconds(trained)
    points = unseen(case.points, options.unseen)
    for row in table.left({"case": name, "parameters": point} for point in points):
        scene = make(**row["parameters"])
        with progress(f"{name}, full model", scene.steps) as report:
            full = run_scene(scene, progress=report)
        table.add({**row, **_row(trained, row["parameters"], scene, full)})


def _training_seconds(trained: jaxsph_rom.TrainedModel) -> dict[str, float]:
    """What training took: full runs, what follows them, and the closure [s]."""
    told = trained.training
    parts = {name: told.get(f"{name}_seconds") or 0.0 for name in ("full", "offline", "closure")}
    return {**parts, "all": sum(parts.values())}


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
        "full_seconds": full.timing.run_seconds,
        "reduced_seconds": prediction.run_seconds,
    }


def _summary(rows: list[dict[str, Any]], training: Mapping[str, float]) -> dict[str, Any]:
    """Errors of members inside and outside, how well these were expected, and the number of full
    runs that training is worth."""
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
        "outside": int((~inside).sum()),
        "median_error_outside": _median(errors[good & ~inside]),
        "break_even": training["all"] / float(np.median([row["full_seconds"] for row in rows])),
    }


def _median(values: np.ndarray) -> float | None:
    return float(np.median(values)) if len(values) else None


def _table(results: Mapping[str, Any]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    header = ("family", "unseen (outside)", "error %", "floor %", "largest %", "outside %",
              "rank correlation", "expected / true (10 to 90 %)", "break-even")  # fmt: skip
    rows = []
    for name, found in results["summary"].items():
        low, middle, high = found["expected_over_true"]
        kinds = ("median_error_inside", "median_floor_inside", "largest_error_inside",
                 "median_error_outside")  # fmt: skip
        percent = (None if found[kind] is None else 100.0 * found[kind] for kind in kinds)
        rows.append((
            name, f"{found['members']} ({found['outside']})", *map(number, percent),
            number(found["rank_correlation"]),
            f"{number(middle)} ({number(low)} to {number(high)})", number(found["break_even"]),
        ))  # fmt: skip
    return header, rows


def page(results: Mapping[str, Any]) -> str:
    """A page of the documentation."""
    header, rows = _table(results)
    settings = results["settings"]
    lines = [header, ("---",) * len(header), *rows]
    table = "\n".join(f"| {' | '.join(cells)} |" for cells in lines)
    about = "\n".join(f"- {name}: {CASES[name].told}" for name in results["summary"])
    return _PAGE.format(**settings, about=about, table=table)


_PAGE = """# Families

<!-- Made by `python -m benchmarks.families` from benchmarks/results/families.json. -->

Reduced models on points over one and two parameters, judged by full runs at unseen parameters,
every third of them outside the training range. {resolution} particles a metre, to {end_time:g} s.

{about}

Errors are those of velocity over all points and times, relative to the largest velocity field: the
median and the largest inside the range, the median outside; the floor is that of the projection
alone. The rank correlation is Spearman's, of the error that a prediction expects of itself
(`error_indicator`) with its true one; beside it stands their ratio, its median and in brackets
where the middle 80 % lie. Break-even is the number of full runs that training is worth, its own
full runs, closure and compilation in it: most of training is compilation at this size, and a full
run takes a second or two.

{table}
"""


if __name__ == "__main__":
    raise SystemExit(main())
