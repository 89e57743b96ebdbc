"""Tables of the pages in docs/measured, made from the stored results.

    python -m benchmarks.pages

A table stands between `<!-- table NAME -->` and `<!-- end -->`; this writes all of them anew. A
test compares them with the results, so that no number on a page is stale.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Iterator
from itertools import product
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
PAGES = ROOT / "docs" / "measured"
_BLOCK = re.compile(r"(<!-- table ([\w-]+) -->\n).*?(?=^<!-- end -->)", re.MULTILINE | re.DOTALL)
Row = dict[str, Any]


def main() -> int:
    """Write all tables anew."""
    for page in sorted(PAGES.glob("*.md")):
        page.write_text(refreshed(page.read_text(encoding="utf-8")), encoding="utf-8")
    return 0


def refreshed(text: str) -> str:
    """A page with its tables as the results have them.

    Raises:
        KeyError: if there is no table of a name.
    """
    return _BLOCK.sub(lambda block: f"{block[1]}\n{TABLES[block[2]]()}\n\n", text)


def results(name: str) -> list[Row]:
    """Rows of a benchmark."""
    path = ROOT / "benchmarks" / "results" / f"{name}.json"
    return json.loads(path.read_text(encoding="utf-8"))["rows"]


def markdown(header: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A table."""
    lines = [tuple(header), *map(tuple, rows)]
    lines.insert(1, ("---",) * len(lines[0]))
    cells = [[f" {cell} " if cell else " " for cell in line] for line in lines]
    return "\n".join(f"|{'|'.join(line)}|" for line in cells)


def short(value: float | None, digits: int = 2) -> str:
    """A number to a few digits, never by powers of ten unless it is tiny."""
    return "" if value is None else f"{float(f'{value:.{digits}g}'):g}"


def several(row: Row, *names: str) -> str:
    """Errors of a row, a slash between."""
    return " / ".join(short(row[f"{name}_error_percent"]) for name in names)


def density(row: Row) -> str:
    """The range over rho0."""
    return f"{row['density_low']:.3f} to {row['density_high']:.3f}"


# ------------------------------------------------------------------ the tables


def schemes() -> str:
    """Both schemes side by side."""
    rows = results("schemes")

    def pair(label: str, of: Callable[[Row], str], **case) -> Iterator[tuple[str, ...]]:
        found = {
            row["scheme"]: row for row in rows if all(row.get(k) == v for k, v in case.items())
        }
        cells = []
        for scheme in ("delta-plus", "consistent"):
            row = found.get(scheme)
            if row is None:
                cells += ["", ""]
            else:
                lost = f"lost at {short(row['reached'])} s"
                cells += [lost if "fault" in row else of(row), short(row["seconds"])]
        if found:
            yield (label, *cells)

    def lines() -> Iterator[tuple[str, ...]]:
        def three(row):
            return several(row, "energy", "velocity", "pressure")

        for reynolds in (100.0, 1000.0):
            for side in (25, 50, 100):
                label = f"Taylor-Green Re {reynolds:g}, {side} x {side}, 1 s: energy / velocity / "
                case = {"kind": "vortex", "side": side, "reynolds": reynolds, "mach": 0.1}
                yield from pair(label + "pressure %", three, **case)
        for side, mach in product((25, 50, 100), (0.05, 0.025)):
            label = f"Taylor-Green Re 100, {side} x {side}, 1 s, at Ma = {mach}"
            yield from pair(label, three, kind="vortex", side=side, mach=mach)
        for side in (24, 32):
            label = f"Taylor-Green in 3D, Re 100, {side}^3, 1 s: kinetic energy %"
            yield from pair(label, lambda row: several(row, "energy"), kind="space", side=side)
        for kind in ("couette", "poiseuille"):
            for side in (25, 50):
                label = f"{kind.capitalize()}, {side} across, Re 10, 0.24 to 2 s: velocity %"
                yield from pair(label, lambda row: several(row, "velocity"), kind=kind, side=side)
        for lid, reynolds, side, end in (
            ("regularised", 100.0, 40, 12.0), ("constant", 100.0, 32, 10.0),
            ("constant", 400.0, 32, 40.0), ("constant", 1000.0, 32, 40.0),
        ):  # fmt: skip
            label = f"cavity, {lid} lid, Re {reynolds:g}, {side} x {side}, {end:g} s: u / v %"
            case = {"kind": "cavity", "lid": lid, "reynolds": reynolds, "side": side, "end": end}
            yield from pair(label, lambda row: several(row, "u", "v"), **case)
        for dim, side in ((2, 20), (3, 8), (3, 10)):
            size = " x ".join([str(side)] * dim)
            for walls, start in (("closed", "rest"), ("periodic", "rest"), ("closed", "gravity")):
                begun = "under gravity" if start == "gravity" else "at rest"
                yield from pair(
                    f"{size}, jittered, {walls}, {begun}, Re 1e6: highest speed after 20 s",
                    lambda row: f"{short(row['last_speed'])} U",
                    kind="box", dim=dim, side=side, walls=walls, start=start,
                )  # fmt: skip
            for walls in ("closed", "periodic"):
                yield from pair(
                    f"{size}, {walls}, kicked by 0.02 U: largest energy over its start",
                    lambda row: short(row["largest_energy_over_start"], 4),
                    kind="box", dim=dim, side=side, walls=walls, start="kick",
                )  # fmt: skip
        yield from pair(
            "disc in rotation, 20 s: change of mean density / angular momentum kept",
            lambda row: (
                f"{row['mean_density_change']:.0e} / {short(row['angular_momentum_kept'])}"
            ),
            kind="disc",
        )
        for side in (20, 40):
            yield from pair(
                f"Taylor-Couette, {side // 4} spacings wide, 20 s: velocity % / change of mean "
                "density",
                lambda row: f"{several(row, 'velocity')} / {row['mean_density_change']:.0e}",
                kind="taylor-couette", side=side,
            )  # fmt: skip

    return markdown(("", "delta-plus", "s", "consistent", "s"), lines())


def scheme_models() -> str:
    """Reduced models on points of both schemes, the worse of the unseen runs."""
    rows = results("scheme_models")
    names = ("velocity_median", "floor_velocity_median", "pressure_median",
             "floor_pressure_median", "sound")  # fmt: skip

    def lines() -> Iterator[tuple[str, ...]]:
        for key in dict.fromkeys((r["scene"], r["modes"], r["closure"]) for r in rows):
            for scheme in ("delta-plus", "consistent"):
                case = (*key, scheme)
                found = [
                    r for r in rows if (r["scene"], r["modes"], r["closure"], r["scheme"]) == case
                ]
                worst = (max(r[f"{name}_percent"] for r in found) for name in names)
                yield (key[0], str(key[1]), key[2], scheme, *map(short, worst))

    header = ("flow", "M", "closure", "scheme", "velocity %", "floor", "pressure %", "floor",
              "full model's sound %")  # fmt: skip
    return markdown(header, lines())


def settled_cavity() -> str:
    """The cavity in the consistent scheme, run until it is steady."""
    header = ("Re", "particles", "u", "v", "Ghia u", "Ghia v", "last change", "half size, then [s]",
              "run [s]")  # fmt: skip
    rows = [
        (
            str(row["reynolds"]),
            f"{row['resolution']} x {row['resolution']}",
            *(
                f"{short(row[f'{name}_error_percent'])} %"
                for name in ("u", "v", "ghia_u", "ghia_v")
            ),
            f"{short(row['change_percent'])} % in {row['change_over_seconds']:.0f} s",
            f"{row['before']:g} + {row['end_time']:g}",
            f"{row['seconds_before']:.0f} + {row['seconds']:.0f}",
        )
        for row in results("lid_driven_cavity")
        if row["scheme"] == "consistent" and row["fault"] is None
    ]
    return markdown(header, rows)


def cavity_of_pysph() -> str:
    """PySPH's example of the cavity, judged as ours is."""
    header = ("Re", "particles", "scheme", "u", "v", "last change", "from rest [s]",
              "processor [s]")  # fmt: skip
    rows = [
        (
            str(row["reynolds"]),
            f"{row['resolution']} x {row['resolution']}",
            {"tvf": "transport velocity", "edac": "EDAC"}[row["scheme"]],
            *(f"{short(row[f'{name}_error_percent'])} %" for name in ("u", "v")),
            f"{short(row['change_percent'])} % in {row['change_over_seconds']:.0f} s",
            f"{row['end_time']:g}",
            f"{row['seconds']:.0f}",
        )
        for row in results("peers_cavity")
        if row["fault"] is None
    ]
    return markdown(header, rows)


def still_water() -> str:
    """Still water and dam breaks in the consistent scheme."""
    header = ("water", "particles", "h/dx", "level", "highest speed at the end", "density / rho0",
              "s")  # fmt: skip
    rows = []
    for row in results("free_surfaces"):
        if row["scheme"] != "consistent":
            continue
        if row["kind"] == "still":
            water = f"still, {row['deep']} deep, {row['dim']}D"
            water += ", disordered" if row["jitter"] else ""
        else:
            water = f"dam break, {row['along']} along the tank, {row['end']:g} s"
            water += " (films held)" if "films" in row else ""
        lost = row["fault"] is not None
        rows.append((
            water,
            str(row["particles"]),
            short(row.get("h_over_dx", 2.0)),
            f"lost at {short(row['reached'])} s"
            if lost
            else f"{row['level_change_percent']:+.2g} %",
            short(row["last_speed"]),
            density(row),
            f"{row['seconds']:.0f}",
        ))  # fmt: skip
    return markdown(header, rows)


def free_flows() -> str:
    """Free surfaces and free shear, each beside what is known of it."""
    header = ("scene", "particles", "scheme", "what is off", "%", "density / rho0", "run [s]")
    rows = [
        (
            row["scene"],
            str(row["particles"]),
            row.get("scheme", "delta-plus") + (" (films held)" if "films" in row else ""),
            row["measure"].replace(" [percent]", ""),
            _error(row),
            density(row),
            f"{row['seconds']:.0f}",
        )
        for row in sorted(
            results("free_flows"),
            key=lambda row: (row["scene"], row["particles"], row.get("scheme", "delta-plus")),
        )
    ]
    return markdown(header, rows)


def _particles(scene: str, size: int, timed: bool) -> str:
    """Models on moving particles at several numbers of modes."""
    header = ("scheme", "M", "projection", "velocity", "pressure", "of the projection",
              "level (peak)", *(("steps of the full model",) if timed else ()))  # fmt: skip
    rows = [
        (
            row["scheme"],
            str(row["modes"]),
            row["projection"],
            *(
                f"{short(row[f'{name}_peak_percent'])} / {short(row[f'{name}_median_percent'])}"
                for name in ("velocity", "pressure", "floor_pressure")
            ),
            short(row["level_peak_percent"]),
            *((short(row["seconds_per_step"] / row["full_seconds_per_step"]),) if timed else ()),
        )
        for row in sorted(
            results(f"particle_modes_{scene}_{size}"),
            key=lambda row: (row["scheme"], row["projection"] != "galerkin", row["modes"]),
        )
    ]
    return markdown(header, rows)


def particle_vortex() -> str:
    """Of the vortex, most rows made on a machine too busy for times."""
    return _particles("taylor_green", 32, timed=False)


def particle_cavity() -> str:
    """Of the cavity."""
    return _particles("lid_driven_cavity", 24, timed=True)


def _predicted(scene: str) -> str:
    """Models on 50 x 50 moving particles at unseen Reynolds numbers, and what they are beside."""
    header = ("start", "Re", "M", "projection", "velocity", "pressure", "of the projection",
              "low-passed", "full model's sound", "level (peak)", "named")  # fmt: skip
    names = ("velocity", "pressure", "floor_pressure", "slow_pressure", "sound")
    rows = [
        (
            row["arrangement"],
            f"{row['reynolds']:g}",
            str(row["modes"]),
            row["projection"],
            *(f"{short(row[f'{n}_peak_percent'])} / {short(row[f'{n}_median_percent'])}"
              for n in names),
            short(row["level_peak_percent"]),
            row["fault"] or row["doubt"] or row["judged"] or "no",
        )
        for row in sorted(
            results(f"particle_modes_{scene}_50"),
            key=lambda r: (r["arrangement"], r["projection"] != "galerkin", r["reynolds"],
                           r["modes"]),
        )
    ]  # fmt: skip
    return markdown(header, rows)


def predicted_vortex() -> str:
    """Of the vortex."""
    return _predicted("taylor_green")


def predicted_cavity() -> str:
    """Of the cavity."""
    return _predicted("lid_driven_cavity")


def particle_step() -> str:
    """What a step on moving particles costs, times of the process."""
    header = ("scene", "particles", "M", "projection", "full [ms]", "reduced [ms]", "ratio")
    return markdown(
        header,
        (
            (
                row["scene"],
                str(row["particles"]),
                str(row["modes"]),
                row["projection"],
                short(1e3 * row["full_process_seconds"]["median"], 3),
                short(1e3 * row["process_seconds"]["median"], 3),
                short(row["process_ratio"]),
            )
            for row in results("particle_step")
        ),
    )


def versions() -> str:
    """This version beside an earlier one."""
    return markdown(
        ("", "earlier [ms]", "now [ms]", "ratio"),
        (
            (
                row["case"],
                short(1e3 * row["earlier_seconds"], 3),
                short(1e3 * row["seconds"], 3),
                short(row["ratio"], 3),
            )
            for row in results("versions")
        ),
    )


def _error(row: Row) -> str:
    if row["fault"]:
        return f"lost at {short(row['reached'])} s"
    period = row.get("period_error_percent")
    return short(abs(row["error_percent"])) + (
        "" if period is None else f" (period {short(abs(period))})"
    )


def cheapest_settings() -> str:
    """The cheapest full model in either scheme and the cheapest reduced model within an error, of
    the Taylor-Green vortex."""
    path = ROOT / "benchmarks" / "results" / "work_precision_full.json"
    rows = json.loads(path.read_text(encoding="utf-8"))["scenes"]["taylor-green"]["rows"]
    kinds = (
        [r for r in rows if r["settings"].get("scheme") == "delta-plus"],
        [r for r in rows if r["settings"].get("scheme") == "consistent"],
        [r for r in rows if r["family"] == "tensor"],
    )

    def best(kind: list[Row], measure: str, wanted: float) -> str:
        within = [r for r in kind if r["fault"] is None and r[measure] <= wanted]
        row = min(within, key=lambda r: r["run_seconds"]["median"], default=None)
        return "none" if row is None else f"{row['label']}: {_time(row['run_seconds']['median'])}"

    wanted = [("velocity", "velocity_peak_percent", e) for e in (2.0, 1.0, 0.5, 0.2)]
    wanted += [("pressure", "pressure_median_percent", e) for e in (10.0, 3.0, 2.0)]
    head = ("wanted", "delta-plus scheme", "consistent scheme", "tensors of delta-plus runs")
    return markdown(
        head,
        ((f"{name} {e:g} %", *(best(kind, measure, e) for kind in kinds))
         for name, measure, e in wanted),
    )  # fmt: skip


def _time(seconds: float) -> str:
    return f"{short(seconds)} s" if seconds >= 0.05 else f"{short(1e3 * seconds)} ms"


def label_models() -> str:
    """Models on labels at the parameters that they have not seen."""
    header = ("wave", "particles", "modes", "at", "height off by %", "mean %", "floor %",
              "sound %", "velocity %", "times faster")  # fmt: skip
    rows = [
        (
            row["scene"],
            str(row["particles"]),
            str(row["modes"]),
            ", ".join(f"{name} {value:g}" for name, value in row["parameters"].items())
            + (" (outside)" if row["outside"] else ""),
            *(
                short(row[f"{name}_percent"])
                for name in ("height_error", "height_error_mean", "height_floor", "sound",
                             "velocity_median")
            ),
            f"{row['times_faster']:.0f}",
        )
        for row in results("label_models")
        if row["model"] == "labels" and not row["seen"]
    ]  # fmt: skip
    return markdown(header, rows)


def label_galerkin() -> str:
    """The projected functional beside the learnt model of the same flow."""
    rows = results("label_models")
    lines = []
    for row in rows:
        if row["model"] != "galerkin":
            continue
        same = ("scene", "resolution", "modes", "parameters")
        learnt = next(
            r for r in rows if r["model"] == "labels" and all(r[k] == row[k] for k in same)
        )
        lines += [
            (
                f"{row['scene']}, {learnt['particles']} particles",
                kind,
                *(short(value) for value in found["height_error_by_period_percent"][::3]),
                short(found["reached_periods"]),
            )
            for kind, found in (("Galerkin", row), (f"learnt, M = {row['modes']}", learnt))
        ]
    header = ("wave", "model", "period 1", "4", "7", "10", "periods reached")
    return markdown(header, lines)


TABLES: dict[str, Callable[[], str]] = {
    table.__name__.replace("_", "-"): table
    for table in (
        schemes, scheme_models, settled_cavity, cavity_of_pysph, still_water, free_flows,
        particle_vortex, particle_cavity, predicted_vortex, predicted_cavity, particle_step,
        versions, cheapest_settings, label_models, label_galerkin,
    )  # fmt: skip
}

if __name__ == "__main__":
    raise SystemExit(main())
