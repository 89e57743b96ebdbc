"""What a step costs on many GPUs, on paper: from counts in compiled programs and makers' figures.

    python -m benchmarks.scale

Nothing is run. Passes over the pairs take the time in which a GPU can read the neighbour list and
its fields once a pass, a floor that no program is under, times `BEHIND`; operations take the time
that starting them takes; messages that of a link. Counts are those of `benchmarks.ahead_of_time`
(operations, temporary bytes) and `benchmarks.devices` (numbers sent).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from jaxsph.arrangements import Lattice
from jaxsph.scenes import taylor_green, taylor_green_3d

from .measure import format_rows, number
from .table import Table, command
from .table_text import results

# makers' figures: NVIDIA H200 (memory, bandwidth, NVLink one way), 400 Gb/s InfiniBand a GPU
MEMORY, BANDWIDTH = 141e9, 4.8e12  # bytes, bytes/s
LINKS = {1: np.inf, 8: 450e9, 64: 50e9}  # bytes/s into a GPU, by the number of GPUs
START = 4e-6  # s to start an operation, about what CUDA takes
BEHIND = 4.0  # times the floor; guessed, until `benchmarks.device_check` has run on a GPU
SIZE = 4  # bytes of a number, float32 and int32 alike
STAGES, STEPS_PER_LIST = 4, 2  # of RK4; the list lasts about two steps
PARTICLES, DEVICES = (10**6, 10**7, 10**8, 10**9), (1, 8, 64)
_PASSES = 3  # over the pairs, of the consistent scheme
_SCENES = {2: (taylor_green, 2.0, 60, "vortex"), 3: (taylor_green_3d, 1.3, 16, "vortex in 3D")}


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 2: bad input."""
    return command("scale", __doc__, lambda add: None, _run, argv)


def _run(options) -> None:
    settings = {"memory": MEMORY, "bandwidth": BANDWIDTH, "start": START, "behind": BEHIND,
                "links": {str(k): v for k, v in LINKS.items() if np.isfinite(v)}}  # fmt: skip
    kept = Table(options.json, ("dim", "particles", "devices"), settings)
    kept.rows[:] = [estimate(dim, n, p) for dim in (2, 3) for n in PARTICLES for p in DEVICES]
    kept.write()
    print(_table(kept.rows))


def estimate(dim: int, particles: int, devices: int) -> dict[str, Any]:
    """Seconds of a step, and bytes on a device, for so many particles on so many GPUs.

    `gathered`: each is sent the fields of all particles; `exchanged`: halos of its own share, a
    slab. Either gathers what particles carry, and sorts all on each device, for each list.
    """
    count = counts(dim)
    own, link = particles / devices, LINKS[devices]
    read = SIZE * own * (_PASSES * (count["slots"] + 2 * dim) + count["sent"])
    floor = read / BANDWIDTH
    sums = BEHIND * floor + START * count["operations"]
    listing = (count["list_over_sums"] - count["sort_over_sums"]) * sums
    listing = listing + count["sort_over_sums"] * sums * devices  # of all particles, on each
    list_share = listing / (STAGES * STEPS_PER_LIST)
    beside = 2.0 * count["halo"] * particles ** ((dim - 1) / dim)  # of both faces of a slab
    share = 1.0 - 1.0 / devices
    carried = (2 * dim + 1) * particles * share / (STAGES * STEPS_PER_LIST)
    sent = {
        "gathered": SIZE * (count["sent"] * particles * share + carried),
        "exchanged": SIZE * (count["sent"] * min(beside, particles * share) + carried),
    }
    alone = STAGES * sums * (1.0 + count["list_over_sums"] / (STAGES * STEPS_PER_LIST))
    taken = STAGES * (sums + list_share)
    held = {
        "gathered": count["sent"] * particles,
        "exchanged": count["sent"] * min(own + beside, particles) + (2 * dim + 1) * particles,
    }
    lists = own * (SIZE * count["slots"] + count["temporary"])
    return {
        "dim": dim,
        "particles": particles,
        "devices": devices,
        "floor_seconds": floor,
        "right_hand_side_seconds": sums,
        **{f"{name}_seconds": taken + STAGES * sent[name] / link for name in sent},
        **{f"{name}_efficiency": alone / (taken + STAGES * sent[name] / link) for name in sent},
        **{f"{name}_gigabytes": (lists + SIZE * held[name]) / 1e9 for name in held},
        **{f"{name}_fits": bool(lists + SIZE * held[name] <= MEMORY) for name in held},
    }


def counts(dim: int) -> dict[str, float]:
    """Per particle, of a right-hand side: slots of the list, numbers sent, temporary bytes; per
    right-hand side: operations, and what a list and its sort cost of one; a halo in spacings."""
    make, h_over_dx, side, name = _SCENES[dim]
    scene = make(side, 100.0, arrangement=Lattice(), h_over_dx=h_over_dx)
    compiled = next(
        row for row in results("ahead_of_time")
        if (row["dim"], row["particles"], row["lowering"], row["program"])
        == (dim, 10**6, "tiles", "right-hand side")
    )  # fmt: skip
    sent = next(row for row in results("devices") if row["scene"] == name
                and row["kind"] == "traffic")  # fmt: skip
    return {
        "slots": scene.search().capacity,
        "halo": min(scene.search().depths) / side ** (dim - 1),
        "operations": compiled["operations"],
        "temporary": compiled["temporary_bytes"] / compiled["particles"],
        "sent": sent["columns_of_halos"],
        "list_over_sums": sent["seconds_of_a_list"] / sent["seconds_of_a_right_hand_side"],
        "sort_over_sums": sent["seconds_of_its_sort"] / sent["seconds_of_a_right_hand_side"],
    }


def _table(rows: list[dict[str, Any]]) -> str:
    names = ("dim", "particles", "devices", "gathered_seconds", "gathered_efficiency",
             "gathered_gigabytes", "exchanged_seconds", "exchanged_efficiency",
             "exchanged_gigabytes")  # fmt: skip
    return format_rows(names, [[number(float(row[name]), 3) for name in names] for row in rows])


if __name__ == "__main__":
    raise SystemExit(main())
