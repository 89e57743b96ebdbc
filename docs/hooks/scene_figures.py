"""What benchmarks have stored of a scene's errors, and a figure of it."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from jaxsph.plotting.style import dress, legend_below, line_style, png, sheet

RESULTS = Path(__file__).parents[2] / "benchmarks" / "results"


@dataclass(frozen=True)
class Stored:
    """Rows of a benchmark that judge a scene.

    Args:
        file: of the results.
        script: that made them.
        label: what the error is, the same for all rows.
        keeps: which rows.
        error: of a row [%].
        resolution: of a row.
        series: of a row.
    """

    file: str
    script: str
    label: str
    keeps: Callable[[dict], bool]
    error: Callable[[dict], float]
    resolution: Callable[[dict], float] = lambda row: row["resolution"]
    series: Callable[[dict], str] = lambda row: row["scheme"]

    def curves(self) -> dict[str, list[tuple[float, float]]]:
        """Resolution and error [%] of each series."""
        found: dict[str, list[tuple[float, float]]] = {}
        for row in rows(self.file):
            if self.keeps(row):
                point = self.resolution(row), self.error(row)
                found.setdefault(self.series(row), []).append(point)
        return {name: sorted(points) for name, points in found.items()}


def rows(file: str) -> list[dict]:
    return json.loads((RESULTS / f"{file}.json").read_text(encoding="utf-8"))["rows"]


def _drag_of_the_literature() -> float:
    """The middle of its range."""
    read = json.loads((RESULTS / "channel_cylinder.json").read_text(encoding="utf-8"))
    return sum(read["literature"]["drag"]) / 2.0


def _of_kind(kind: str, reynolds: float) -> Callable[[dict], bool]:
    return lambda row: (row["kind"], row.get("reynolds")) == (kind, reynolds)


def _schemes(label: str, kind: str, reynolds: float) -> Stored:
    return Stored("schemes", "schemes", label, _of_kind(kind, reynolds),
                  lambda row: row["velocity_error_percent"], lambda row: row["side"])  # fmt: skip


_STORED = {
    "taylor-green": Stored(
        "convergence", "convergence", "velocity error at Re = 100, t = 1 s, relative L2 [%]",
        lambda row: row["shifting"] and row["precision"] == "float64",
        lambda row: 100.0 * row["velocity_error"], series=lambda row: "delta-plus",
    ),
    "couette": _schemes("velocity error beside the exact one, relative L2 [%]", "couette", 10.0),
    "poiseuille": _schemes("velocity error beside the exact one, relative L2 [%]", "poiseuille",
                           10.0),
    "hydrostatic-tank": Stored(
        "plane_flows", "plane_flows", "pressure error, root mean square [%]",
        lambda row: row["flow"] == "hydrostatic-tank",
        lambda row: row["pressure_error_rms_percent"], series=lambda row: "delta-plus",
    ),
    "lid-driven-cavity": Stored(
        "lid_driven_cavity", "lid_driven_cavity",
        "largest error of the velocity on the centre lines [%]",
        lambda row: row["lid"] == "constant" or row["scheme"] == "delta-plus",
        lambda row: max(row["u_error_percent"], row["v_error_percent"]),
        series=lambda row: f"{row['scheme']}, {row['lid']} lid, Re {row['reynolds']:g}",
    ),
    "channel-cylinder": Stored(
        "channel_cylinder", "channel_cylinder", "drag beside the middle of the literature's [%]",
        lambda row: True,
        lambda row: 100.0 * abs(row["drag"] / _drag_of_the_literature() - 1.0),
        series=lambda row: f"h = {row['h_over_dx']:g} dx, {row['ends']}, ghosts: {row['ghosts']}",
    ),
}  # fmt: skip


def measured(scene: str) -> Stored | None:
    """Stored results of a scene, if there are some."""
    if scene in _STORED:
        return _STORED[scene]
    mine = [row for row in rows("free_flows") if row["scene"] == scene]
    if not mine:
        return None
    label = mine[0]["measure"].replace("[percent]", "[%]")
    return Stored("free_flows", "free_flows", label, lambda row: row["scene"] == scene,
                  lambda row: row["error_percent"])  # fmt: skip


def figure(stored: Stored) -> bytes:
    """Error against resolution, as PNG."""
    page, curves = sheet(6.5, 3.6), stored.curves()
    axes = page.subplots()
    dress(axes, "resolution (particles per longest side)", "error [%]")
    for number, (name, points) in enumerate(curves.items()):
        axes.plot(*zip(*points, strict=True), marker="o", label=name, **line_style(number))
    resolutions, errors = zip(*sum(curves.values(), []), strict=True)
    axes.set(xscale="log", yscale="log")
    axes.minorticks_off()
    ticks = sorted(set(resolutions))
    axes.set_xticks(ticks, [f"{x:g}" for x in ticks])
    ticks = _rounded(min(errors), max(errors))
    axes.set_yticks(ticks, [f"{y:g}" for y in ticks])
    axes.set_ylim(0.95 * ticks[0], 1.05 * ticks[-1])
    legend_below(page, axes.get_lines())
    return png(page)


def _rounded(low: float, high: float) -> list[float]:
    """Numbers 1, 2 or 5 times a power of ten round a range, its ends included."""
    every = [digit * 10.0**power for power in range(-4, 4) for digit in (1, 2, 5)]
    first = max(k for k, value in enumerate(every) if value <= low)
    last = min(k for k, value in enumerate(every) if value >= high)
    return every[first : last + 1]
