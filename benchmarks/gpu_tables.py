"""Tables of GPUs and of several devices."""

from __future__ import annotations

import math
from collections.abc import Iterator

from .table_text import Row, markdown, results, short


def ahead_of_time() -> str:
    """Programs for a GPU, with pair sums in chunks and in a kernel of their own."""
    rows = results("ahead_of_time")
    cases = dict.fromkeys((r["dim"], r["particles"], r["program"]) for r in rows)

    def lines() -> Iterator[tuple[str, ...]]:
        for dim, particles, program in cases:
            case = {"dim": dim, "particles": particles, "program": program}
            before, now = (
                next(r for r in rows if case.items() <= r.items() and r["lowering"] == lowering)
                for lowering in ("chunks", "tiles")
            )
            yield (
                f"{particles:,} in {dim}D: {program}",
                f"{before['operations']:,}",
                f"{now['operations']:,}",
                short(now["temporary_bytes"] / 1e9),
                str(now["registers"]),
                str(now["spilled_bytes"]),
            )

    header = ("", "operations in chunks", "now", "temporary [GB]", "registers", "spilled [bytes]")
    return markdown(header, lines())


def devices() -> str:
    """What devices tell one another, and what that allows."""

    def line(row: Row) -> tuple[str, ...]:
        count, seconds = row["particles"], row["seconds_of_a_right_hand_side"]
        numbers = row["numbers_for_a_right_hand_side"]
        sent = 8 * (numbers + row["numbers_for_a_list"] / 8)  # a list for eight right-hand sides
        beside_halos = numbers - row["numbers_in_halos"]
        columns = row["numbers_were_all_gathered"] - beside_halos  # in the other program
        model = 2 * row["rows_of_a_halo"] * columns / count
        return (
            f"{row['scene']}, {count:,}",
            f"{row['rows_of_a_device']:,} / {row['rows_of_a_halo']:,}",
            short(row["numbers_were_all_gathered"]),
            short(numbers),
            f"{short(row['numbers_in_halos'])} / {short(model)}",
            short(row["numbers_for_a_list"]),
            f"{short(row['list_bytes'] / 1e6)} / {short(row['list_bytes_of_a_device'] / 1e6)}",
            short(1e6 * seconds / count),
            short(row["seconds_of_a_list"] / seconds),
            short(row["seconds_of_its_sort"] / seconds),
            short(8 * sent * count / seconds / 1e9),
        )

    header = (
        "particles", "rows of a device / of a halo", "numbers sent for a right-hand side: gathered",
        "by halos", "of these in halos / 2 x halo x columns", "for a list",
        "list, whole / of a device [MB]", "right-hand side [us a particle]",
        "a list [right-hand sides]", "its sort", "4 times as fast from [GB/s]",
    )  # fmt: skip
    rows = (row for row in results("devices") if row["kind"] == "traffic")
    return markdown(header, map(line, rows))


def device_differences() -> str:
    """How equal runs over several devices are to those of one."""

    def both(row: Row, name: str) -> str:
        return f"{short(row['of_devices'][name])} / {short(row['of_another_order'][name])}"

    fields = ("position", "velocity", "density")
    rows = [row for row in results("devices") if row["kind"] == "differences"]
    return markdown(
        ("", *fields, "gradient"),
        (
            (f"{row['scene']}, {row['particles']:,}", *(both(row, name) for name in fields),
             short(row["of_gradient"]))
            for row in rows
        ),
    )  # fmt: skip


def sums_on_a_gpu() -> str:
    """What a right-hand side takes on one GPU, on paper."""
    rows = [row for row in results("scale") if row["devices"] == 1]
    return markdown(
        ("", "floor [ms]", "estimate [ms]"),
        [
            (
                f"10^{round(math.log10(row['particles']))} in {row['dim']}D",
                short(1e3 * row["floor_seconds"]),
                short(1e3 * row["right_hand_side_seconds"]),
            )
            for row in rows
        ],
    )


def scale() -> str:
    """A step on many GPUs, on paper."""
    header = ("particles", "GPUs", "gathered: step", "efficiency", "GB on each", "exchanged: step",
              "efficiency", "GB on each")  # fmt: skip

    def line(row: Row) -> tuple[str, ...]:
        cells = [f"10^{len(str(row['particles'])) - 1} in {row['dim']}D", str(row["devices"])]
        for name in ("gathered", "exchanged"):
            held = short(row[f"{name}_gigabytes"])
            cells += [
                f"{short(1e3 * row[f'{name}_seconds'])} ms",
                short(row[f"{name}_efficiency"]),
                held if row[f"{name}_fits"] else f"{held}, too much",
            ]
        return tuple(cells)

    return markdown(header, map(line, results("scale")))
