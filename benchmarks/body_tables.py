"""Tables of bodies that the fluid moves, and of walls that turn."""

from __future__ import annotations

from .table_text import markdown, results, short


def floating_box() -> str:
    """Period of heave and draught of the box."""
    header = ("particles along the tank", "box let go", "found", "expected", "off", "angle [rad]")

    def line(row):
        dx = short(row["lift"] / row["spacing"], 2)
        if row["period"] is None:
            start, of = "in its place", "draught"
            found, expected = row["draught"], row["draught"] / (
                1.0 + row["draught_error_percent"] / 100.0
            )
        else:
            start, of = f"{dx} dx above", "period"
            found, expected = row["period"], row["linear_period"]
        unit = "s" if of == "period" else "m"
        off = short(row[f"{of}_error_percent"], 2)
        return (
            str(row["resolution"]), start, f"{of} {short(found, 4)} {unit}",
            f"{short(expected, 4)} {unit}", f"{off} %", short(row["largest_angle"], 2),
        )  # fmt: skip

    return markdown(header, (line(row) for row in results("floating_box")))


def floating_ball() -> str:
    """Heave of the ball beside linear theory."""
    header = (
        "particles a diameter", "its room / volume", "tank [m]", "particles", "period [s]",
        "linear theory",
        "first trough / lift", "linear theory", "then crest / lift", "linear theory",
        "sideways / dx", "steps", "run [s]",
    )  # fmt: skip
    return markdown(
        header,
        (
            (
                str(row["resolution"]),
                short(row["room"], 3),
                f"{row['width']:g}",
                str(row["particles"]),
                short(row["period"], 3),
                short(row["linear_period"], 3),
                short(row["trough"], 3),
                short(row["linear_trough"], 3),
                short(row["crest"], 3),
                short(row["linear_crest"], 3),
                short(row["sideways_in_spacings"], 1),
                str(row["steps"]),
                short(row["seconds"], 3),
            )
            for row in results("floating_ball")
        ),
    )


def light_bodies() -> str:
    """The longest stable steps of light bodies, and how they start to rise."""
    header = (
        "scheme", "density / water's", "limit", "stable at", "lost at",
        "rises at [m/s^2]", "potential flow",
    )  # fmt: skip
    return markdown(
        header,
        (
            (
                row["scheme"],
                f"{row['ratio']:g}",
                short(row["limit_share"], 2),
                short(row["stable_share"], 2),
                "-" if row["lost_share"] is None else short(row["lost_share"], 2),
                short(row["acceleration"], 3),
                short(row["potential_acceleration"], 3),
            )
            for row in results("light_bodies")
        ),
    )


def channel_cylinder() -> str:
    """Drag, lift and pressure difference of the cylinder in a channel."""
    header = ("ghosts", "ends", "particles a diameter", "drag", "lift", "pressure difference [Pa]",
              "mass flux off", "run [s]")  # fmt: skip
    names = ("h_over_dx", "ghosts", "ends", "resolution")
    rows = sorted(results("channel_cylinder"), key=lambda row: [row[name] for name in names])
    return markdown(
        header,
        [
            (
                row["ghosts"] + ("" if row["h_over_dx"] == 1.5 else ", h = 2 dx"),
                row["ends"],
                short(row["across_cylinder"], 3),
                f"{row['drag']:.3f} +- {row['drag_known_to']:.3f}",
                f"{row['lift']:.3f} +- {row['lift_known_to']:.3f}",
                short(row["pressure_difference"], 4),
                f"{short(row['mass_flux_off_percent'], 2)} %",
                f"{row['seconds']:.0f}",
            )
            for row in rows
        ],
    )


def taylor_couette() -> str:
    """Torques between cylinders."""
    header = (
        "ghosts", "turns", "h / dx", "to the inner radius", "torque, inner", "outer", "velocity"
    )  # fmt: skip
    names = ("inner_torque_error_percent", "outer_torque_error_percent", "velocity_error_percent")
    order = ("ghosts", "turns", "h_over_dx", "resolution")
    rows = sorted(results("taylor_couette"), key=lambda row: [row[name] for name in order])
    return markdown(
        header,
        (
            (
                row["ghosts"],
                row["turns"],
                short(row["h_over_dx"]),
                str(row["resolution"]),
                *(f"{short(row[name], 2)} %" for name in names),
            )
            for row in rows
        ),
    )
