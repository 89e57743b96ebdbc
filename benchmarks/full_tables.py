"""Tables of the full model: schemes, walls, free surfaces, versions."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import product

from .references.dam_break_3d import ARRIVAL, HEIGHT
from .table_text import Row, density, markdown, results, several, short


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


def right_hand_sides() -> str:
    """What one costs in each scheme, and its gradient by reverse mode in right-hand sides."""
    both = ("delta-plus", "consistent")
    header = ("flow", "side", *(f"{scheme} [ms]" for scheme in both), "ratio", "gradients")
    rows = [
        (
            row["scene"],
            str(row["side"]),
            *(short(row[f"{scheme}_ms"], 3) for scheme in both),
            short(row["ratio"], 3),
            " / ".join(short(row[f"{scheme}_reverse_over_forward"]) for scheme in both),
        )
        for row in results("schemes")
        if row["kind"] == "rates"
    ]
    return markdown(header, rows)


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


def dam_break_3d() -> str:
    """Water heights at the gauges beside the experiment's."""
    shown = (0.4, 0.8, 1.2)
    header = ("scheme", "along the tank", "gauge", "front there [s]", "measured",
              *(f"height at {t:g} s, measured [m]" for t in shown), "mean off [%]")  # fmt: skip

    def line(row, name):
        at = {t: round(t / row["time"][1]) for t in shown if t <= row["time"][-1] + 1e-9}
        arrival, ours, theirs = row.get(f"{name}_arrival"), row[name], HEIGHT[name]
        return (
            row["scheme"], str(row["resolution"]), name,
            "" if arrival is None else short(arrival, 2),
            short(ARRIVAL[name], 3) if name in ARRIVAL else "",
            *(f"{ours[at[t]]:.2f}, {theirs[at[t]]:.2f}" if t in at else "" for t in shown),
            short(row[f"{name}_off_percent"], 2),
        )  # fmt: skip

    rows = [row for row in results("dam_break_3d") if row["fault"] is None]
    rows.sort(key=lambda row: (row["scheme"], row["resolution"]))
    return markdown(header, (line(row, name) for row in rows for name in reversed(HEIGHT)))


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
