"""Tables of flows past bodies and steps beside the literature, reduced models beside them."""

from __future__ import annotations

from .table_text import markdown, results, short


def cylinder_wake() -> str:
    """Coefficients by Reynolds number, resolution and width of the stream."""
    header = ("Re", "ghosts", "ends", "particles a diameter", "cylinders apart [D]",
              "stream ahead [D]", "drag", "lift amplitude", "Strouhal", "wake [D]", "steps",
              "run [s]")  # fmt: skip
    rows = [
        (
            short(row["reynolds"], 3),
            row["ghosts"],
            row["ends"],
            str(row["resolution"]),
            f"{row['width']:g}",
            f"{row['upstream']:g}",
            short(row["drag"], 3),
            *(
                "" if row.get(name) is None else short(row[name], 3)
                for name in ("lift_amplitude", "strouhal", "wake_length")
            ),
            str(row["steps"]),
            f"{row['seconds']:.0f}",
        )
        for row in sorted(
            results("cylinder_wake"),
            key=lambda row: tuple(
                row[name]
                for name in ("reynolds", "ghosts", "ends", "upstream", "width", "resolution")
            ),
        )
        if row["fault"] is None
    ]
    return markdown(header, rows)


def drag_slopes() -> str:
    """Derivatives of mean drag beside central differences."""
    rows = sorted(results("drag_slopes"), key=lambda row: row["seconds_of_flow"])
    steps = list(rows[0]["slopes"][0]["deviation_by_difference"])
    header = ("s of flow", "steps", "mean drag [N]", "in", "slope [N]", "forward off reverse",
              *(f"off, by {step}" for step in steps))  # fmt: skip
    return markdown(
        header,
        [
            (
                f"{row['seconds_of_flow']:g}",
                str(row["steps"]),
                short(row["drag"], 4),
                slope["parameter"],
                short(slope["drag_per_share"], 4),
                f"{slope['forward_deviation']:.0e}",
                *(f"{slope['deviation_by_difference'][step]:.0e}" for step in steps),
            )
            for row in rows
            for slope in row["slopes"]
        ],
    )


def wake_models() -> str:
    """Reduced models of the developed wake, at Reynolds numbers that they have not seen."""
    header = ("M", "closure", "trained on [s]", "Re", "periods", "Strouhal off by %", "drag %",
              "lift %", "phase at the end, % of a period", "velocity %", "floor %",
              "full, reduced [s]", "times faster")  # fmt: skip

    def line(row) -> tuple[str, ...]:
        return (
            str(row["modes"]),
            row["closure"],
            f"{row['recorded']:g}",
            short(row["reynolds"], 3),
            *(
                (row["fault"], *[""] * 8)
                if row["fault"]
                else (
                    short(row["periods"]),
                    *(short(row[name]) for name in _WAVE),
                    short(row["velocity_error_percent"]),
                    short(row["velocity_floor_percent"]),
                    f"{row['full_seconds']:.0f}, {short(row['reduced_seconds'])}",
                    f"{row['times_faster']:.0f}",
                )
            ),
        )

    rows = _wakes("developed")
    again = [
        ("full model, again", "", "", short(row["reynolds"], 3), short(row["periods"]),
         *(short(row["full_again"][name]) for name in _WAVE), "", "", "", "")
        for row in _run_twice(rows)
    ]  # fmt: skip
    return markdown(header, [*map(line, rows), *again])


_WAVE = ("strouhal_error_percent", "drag_error_percent", "lift_error_percent",
         "phase_error_percent_of_a_period")  # fmt: skip


def _wakes(start: str):
    rows = (row for row in results("wake_models") if row["start"] == start)
    names = ("recorded", "modes", "reynolds", "seconds_of_flow")
    return sorted(
        rows, key=lambda row: (row["closure"] != "none", *(row[name] for name in names))
    )


def _run_twice(rows):
    """One row of each flow of which the full model was run twice."""
    found = {(r["reynolds"], r["seconds_of_flow"]): r for r in rows if r.get("full_again")}
    return found.values()


def _seconds(value: float | None) -> str:
    return "never" if value is None else f"{value:.0f}"


def wake_transients() -> str:
    """Reduced models of a wake that begins to shed, at numbers that they have not seen."""
    header = ("M", "closure", "Re", "sheds from, full / here [s]", "Strouhal off by %", "drag %",
              "lift %", "phase at the end, % of a period", "velocity %", "floor %",
              "times faster")  # fmt: skip
    rows = _wakes("steady")

    def line(row) -> tuple[str, ...]:
        return (
            str(row["modes"]),
            row["closure"],
            short(row["reynolds"], 3),
            *(
                (row["fault"], *[""] * 7)
                if row["fault"]
                else (
                    f"{row['onset_full']:.0f} / {_seconds(row['onset'])}",
                    *(short(row[name]) for name in _WAVE),
                    short(row["velocity_error_percent"]),
                    short(row["velocity_floor_percent"]),
                    f"{row['times_faster']:.0f}",
                )
            ),
        )

    again = [
        ("full model, again", "", short(row["reynolds"], 3),
         f"{row['onset_full']:.0f} / {row['full_again']['onset']:.0f}",
         *(short(row["full_again"][name]) for name in _WAVE), "", "", "")
        for row in _run_twice(rows)
    ]  # fmt: skip
    return markdown(header, [*map(line, rows), *again])


def open_flux() -> str:
    """What flows through the sections of an open channel, beside what flows in."""
    header = ("particles across", "ends", "Mach", "compressed from end to end", "mass off",
              "mass, section to section", "volume off", "run [s]")  # fmt: skip
    names = ("compressed", "mass_off", "mass_lost_on_the_way", "volume_off")
    rows = [
        (
            str(row["resolution"]),
            row["ends"],
            f"{row['mach']:g}",
            *(f"{short(100.0 * row[name])} %" for name in names),
            f"{row['seconds']:.0f}",
        )
        for row in sorted(
            results("open_flux"), key=lambda row: (row["ends"], row["resolution"], -row["mach"])
        )
        if row["fault"] is None
    ]
    return markdown(header, rows)


def backward_facing_step() -> str:
    """Where the flow over a step comes back to the wall."""
    header = ("Re", "particles over the step", "reattachment [steps]", "Erturk (2008)", "off",
              "flux off", "changed by", "run [s]")  # fmt: skip
    rows = [
        (
            short(row["reynolds"], 3),
            str(row["resolution"]),
            short(row["reattachment"], 4),
            short(row["reattachment"] / (1.0 + row["reattachment_error_percent"] / 100.0), 4),
            f"{short(row['reattachment_error_percent'])} %",
            f"{short(row['flux_error_percent'])} %",
            f"{short(row['change_percent'])} %",
            f"{row['seconds']:.0f}",
        )
        for row in results("backward_facing_step")
        if row["fault"] is None
    ]
    return markdown(header, rows)
