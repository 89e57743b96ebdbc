"""Tables of reduced models: in both schemes, on particles, on labels, by what they cost."""

from __future__ import annotations

import json
from collections.abc import Iterator

from .table_text import ROOT, Row, duration, markdown, results, short


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


def _beside_the_paper(scale: str) -> str:
    """Models of the vortex at a size, and what the paper prints of its own."""
    header = ("Re", "", "M", "projection", "velocity %", "paper", "pressure %: peak, median",
              "paper", "full [s]", "reduced")  # fmt: skip
    notes = {"pressure below 10": "below 10", "velocity 7 to 8, pressure unstable": "unstable"}
    rows = sorted(
        results(f"taylor_green_{scale}", "cases"),
        key=lambda row: (row["kind"] == "predictive", row["reynolds"], row["modes"]),
    )
    return markdown(
        header,
        (
            (
                f"{row['reynolds']:g}",
                {"reconstructive": "reconstructed", "predictive": "predicted"}[row["kind"]],
                str(row["modes"]),
                {"points": "none: on points"}.get(row["projection"], row["projection"]),
                short(row["velocity_peak_percent"]),
                short(row["paper_velocity_peak_percent"]),
                f"{short(row['pressure_peak_percent'], 3)}, "
                f"{short(row['pressure_median_percent'], 3)}",
                notes.get(row["paper_note"], short(row["paper_pressure_peak_percent"])),
                short(row["fom_seconds"], 3),
                duration(row["rom_seconds"]),
            )
            for row in rows
        ),
    )


def paper_small() -> str:
    """Of 50 x 50 particles, h = 2 dx."""
    return _beside_the_paper("small")


def paper_half() -> str:
    """Of 150 x 150 particles, h = 4 dx."""
    return _beside_the_paper("half")


def paper_size() -> str:
    """Of 300 x 300 particles, h = 4 dx, the paper's."""
    return _beside_the_paper("paper")


def paper_energy() -> str:
    """What the first modes hold of the snapshots of 300 x 300 particles, and of the paper's."""
    path = ROOT / "benchmarks" / "results" / "taylor_green_paper.json"
    found = json.loads(path.read_text(encoding="utf-8"))["cumulative_energy_percent"]["euclidean"]
    spaces = {"lagrangian": "labels", "reference": "points"}
    return markdown(
        ("fields on", "M", "cumulative energy %", "paper"),
        (
            (title, modes, short(found[space][modes], 6), short(printed, 6))
            for space, title in spaces.items()
            for modes, printed in found["paper"][space].items()
        ),
    )


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


def _predicted(scene: str, *sides: int, size: str = "{0} x {0}") -> str:
    """Models on moving particles at unseen Reynolds numbers, and what they are beside."""
    header = ("particles", "start", "Re", "M", "projection", "velocity", "pressure",
              "of the projection", "low-passed", "full model's sound", "level (peak)",
              "named")  # fmt: skip
    names = ("velocity", "pressure", "floor_pressure", "slow_pressure", "sound")
    rows = [
        (
            size.format(side),
            row["arrangement"],
            f"{row['reynolds']:g}",
            str(row["modes"]),
            row["projection"],
            *(f"{short(row[f'{n}_peak_percent'])} / {short(row[f'{n}_median_percent'])}"
              for n in names),
            short(row["level_peak_percent"]),
            row["fault"] or row["doubt"] or row["judged"] or "no",
        )
        for side in sides
        for row in sorted(
            results(f"particle_modes_{scene}_{side}"),
            key=lambda r: (r["arrangement"], r["projection"] != "galerkin", r["reynolds"],
                           r["modes"]),
        )
    ]  # fmt: skip
    return markdown(header, rows)


def predicted_vortex() -> str:
    """Of the vortex."""
    return _predicted("taylor_green", 50, 64)


def predicted_cavity() -> str:
    """Of the cavity."""
    return _predicted("lid_driven_cavity", 50)


def larger_cavity() -> str:
    """Of the cavity of 100 x 100 particles, at the Reynolds number that it was trained at."""
    return _predicted("lid_driven_cavity", 100)


def settled_open_cavity() -> str:
    """Of the open cavity, once it has settled."""
    return _predicted("open_cavity", 80, size="dx = 5 mm")


def particle_step() -> str:
    """What a step on moving particles costs, times of the process."""
    header = ("scene", "particles", "M", "projection", "full [ms]", "reduced [ms]", "ratio")
    rows = sorted(
        results("particle_step"),
        key=lambda row: (row["scene"] != "taylor-green", row["projection"] != "galerkin"),
    )
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
            for row in rows
        ),
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
        if row is None:
            return "none"
        return f"{row['label']}: {duration(row['run_seconds']['median'])}"

    wanted = [("velocity", "velocity_peak_percent", e) for e in (2.0, 1.0, 0.5, 0.2)]
    wanted += [("pressure", "pressure_median_percent", e) for e in (10.0, 3.0, 2.0)]
    head = ("wanted", "delta-plus scheme", "consistent scheme", "tensors of delta-plus runs")
    return markdown(
        head,
        ((f"{name} {e:g} %", *(best(kind, measure, e) for kind in kinds))
         for name, measure, e in wanted),
    )  # fmt: skip


def density_readings() -> str:
    """What the paper's cavity looks like at either reference density."""
    header = ("cavity", "rho0", "M", "energy left, labels %", "paper's", "points %", "paper's",
              "floor of velocity", "of pressure")  # fmt: skip
    rows = [
        (
            f"{row['resolution']} x {row['resolution']}",
            f"{row['reference_density']:g}",
            str(row["modes"]),
            *(
                short(row[f"{space}_{of}_left_percent"])
                for space in ("lagrangian", "reference")
                for of in ("energy", "paper")
            ),
            *(
                f"{short(row[f'{name}_floor_peak_percent'])} / "
                f"{short(row[f'{name}_floor_median_percent'])}"
                for name in ("velocity", "pressure")
            ),
        )
        for row in results("density_readings")
    ]
    return markdown(header, rows)


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
                (f"lost after {row['reached_periods']:.1f} periods", "")
                if row["fault"]
                else (short(row["height_error_percent"]), short(row["height_error_mean_percent"]))
            ),
            short(row["height_floor_percent"]),
            short(row["sound_percent"]),
            "" if row["fault"] else short(row["velocity_median_percent"]),
            "" if row["fault"] else f"{row['times_faster']:.0f}",
        )
        for row in results("label_models")
        if row["model"] == "labels" and not row["seen"]
    ]  # fmt: skip
    return markdown(header, rows)


def label_samples() -> str:
    """The full functional at a few particles."""
    header = ("particles", "that are followed", "modes", "at", "height off by %", "mean %",
              "full [s]", "reduced [s]", "times faster")  # fmt: skip
    rows = [
        (
            str(row["particles"]),
            str(row["members"]),
            str(row["modes"]),
            ", ".join(f"{name} {value:g}" for name, value in row["parameters"].items())
            + (" (outside)" if row["outside"] else ""),
            *(
                (f"lost after {row['reached_periods']:.1f} periods", "")
                if row["fault"]
                else (short(row["height_error_percent"]), short(row["height_error_mean_percent"]))
            ),
            short(row["full_process_seconds"]),
            short(row["reduced_process_seconds"]),
            short(row["times_faster"]),
        )
        for row in sorted(results("label_models"), key=lambda row: row["resolution"])
        if row["model"] == "sampled"
    ]
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
