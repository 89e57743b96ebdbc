"""What flows through a channel that is open at both ends, section by section: mass and volume.

    python -m benchmarks.open_flux --resolutions 20 --machs 0.05 0.025

`poiseuille-open` at Re = 10 from its plug start, judged once it has settled. Every particle that
passes a section is counted, at the time when it does (linear between snapshots a few steps apart),
forwards less backwards, with its mass, and with its volume m / rho then. The mean over time is
weighted by a window that rises from and falls to zero (Hann's), so that no particle counts in full
or not at all at the window's ends. Mass is beside rho0 U H of the inflow's mean speed U, volume
beside U H, and mass of each section beside the mean of all: what the channel loses between them.
Every finished run's row is in the JSON file at once; the same command goes on where it was cut
short.
"""

from __future__ import annotations

import dataclasses
from itertools import product
from typing import Any

import numpy as np
from jaxtyping import Float

from jaxsph import Trajectory
from jaxsph.cli import positive_float, positive_int
from jaxsph.scenes import Scene, poiseuille_open
from jaxsph.scenes.poiseuille_open import HEIGHT, LENGTH, MEAN, SCALES

from .measure import format_rows, number
from .open_flows import ran
from .table import Table, command

KEY = ("resolution", "ends", "mach", "reynolds", "end_time", "settled")
REYNOLDS = 10.0
SECTIONS = 9  # in the channel, evenly, from a tenth of it to nine tenths
EACH = 5  # steps from snapshot to snapshot, or fewer
_STEP = 5e-3  # s, at 20 particles across and the scene's own Mach number of 0.05


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: a run failed, 2: bad input."""
    return command("open_flux", __doc__, _arguments, _run, argv)


def _arguments(add) -> None:
    add("--resolutions", type=positive_int, nargs="+", default=[20], metavar="N",
        help="particles across (default: 20)")  # fmt: skip
    add("--ends", choices=("fringe", "openings"), default="fringe", help="default: fringe")
    add("--machs", type=positive_float, nargs="+", default=[0.05, 0.025], metavar="M",
        help="default: 0.05 0.025")  # fmt: skip
    add("--t-end", type=positive_float, default=8.0, metavar="T", help="default: 8 s")
    add("--settled", type=positive_float, default=3.0, metavar="T",
        help="when means begin (default: 3 s)")  # fmt: skip


def _run(options) -> bool:
    if options.settled >= options.t_end:
        raise ValueError(f"--settled: must be before the end, got {options.settled:g} s.")
    kept = Table(options.json, KEY)
    cases = (
        dict(zip(KEY, (*case, REYNOLDS, options.t_end, options.settled), strict=True))
        for case in product(options.resolutions, [options.ends], options.machs)
    )
    for case in kept.left(cases):
        kept.add(case | run(case))
    print(_table(kept.rows))
    return any(row["fault"] for row in kept.rows)


def run(case: dict[str, Any]) -> dict[str, Any]:
    """The fluxes of one run."""
    scene = make_scene(case)
    trajectory, row = ran(scene, f"{case['resolution']} across, Mach {case['mach']:g}")
    if row["fault"]:
        return row
    sections = np.linspace(0.0, LENGTH, SECTIONS + 2)[1:-1]
    mass, volume = passing(scene, trajectory, sections, case["settled"])
    mass, volume = mass / (MEAN * HEIGHT), volume / (MEAN * HEIGHT)  # rho0 = 1
    return row | {
        "sections": sections.tolist(),
        "mass_flux": mass.tolist(),
        "volume_flux": volume.tolist(),
        "mass_off": float(np.abs(mass - 1.0).max()),
        "mass_lost_on_the_way": float(np.abs(mass / mass.mean() - 1.0).max()),
        "volume_off": float(np.abs(volume - 1.0).max()),
        "compressed": 8.0 * case["mach"] ** 2 * LENGTH / (case["reynolds"] * HEIGHT),
        "turned_over": float(MEAN * (case["end_time"] - case["settled"]) / LENGTH),
    }


def make_scene(case: dict[str, Any]) -> Scene:
    """The scene, with a step that its speed of sound allows and a snapshot every few steps."""
    scale = SCALES["small"]
    step = _STEP * (scale.resolution / case["resolution"]) * min(1.0, case["mach"] / 0.05)
    steps = EACH * max(1, round(case["end_time"] / (EACH * step)))
    scene = poiseuille_open(
        case["resolution"],
        case["reynolds"],
        ends=case["ends"],
        mach=case["mach"],
        end_time=case["end_time"],
        time_step=case["end_time"] / steps,
        h_over_dx=scale.h_over_dx,
    )
    return dataclasses.replace(scene, steps_per_snapshot=EACH)


def passing(
    scene: Scene,
    trajectory: Trajectory,
    sections: Float[np.ndarray, " sections"],
    settled: float,
) -> tuple[Float[np.ndarray, " sections"], Float[np.ndarray, " sections"]]:
    """Mass [kg/s] and volume [m^3/s] that pass sections x = const, a metre deep, in the mean over
    the time from when the flow has settled."""
    late = np.flatnonzero(trajectory.time >= settled * (1.0 - 1e-9))
    time, mass = trajectory.time[late], float(scene.mass)
    length = scene.space.box.lengths[0]
    x, density = trajectory.position[late][..., 0], trajectory.density[late]
    way = np.diff(x, axis=0)
    wraps = length * np.round(way / length)  # none goes half around the box
    periodic = scene.space.box.periodic[0]
    way -= wraps if periodic else 0.0
    stayed = periodic | (wraps == 0.0)  # what is put in or parked passes no section
    found = np.zeros((2, len(sections)))
    for where, section in enumerate(sections):
        before = x[:-1] - section
        if periodic:
            before = (before + 0.5 * length) % length - 0.5 * length  # nearest image
        after = before + way
        there = stayed & ((before < 0.0) != (after < 0.0))
        share = -before[there] / way[there]
        step, who = np.nonzero(there)
        when = time[step] + share * (time[step + 1] - time[step])
        weight = np.sin(np.pi * (when - time[0]) / (time[-1] - time[0])) ** 2
        weight *= 2.0 * mass * np.sign(way[there]) / (time[-1] - time[0])
        then = density[step, who] + share * (density[step + 1, who] - density[step, who])
        found[:, where] = weight.sum(), (weight / then).sum()
    return found[0], found[1]


def _table(rows) -> str:
    head = ("across", "ends", "Mach",
            "mass off", "lost on the way", "volume off", "compressed", "seconds")  # fmt: skip
    names = ("mass_off", "mass_lost_on_the_way", "volume_off", "compressed", "seconds")
    found = [
        (str(row["resolution"]), row["ends"], number(row["mach"]),
         *(number(row.get(n), 2) for n in names))
        for row in rows
    ]  # fmt: skip
    return format_rows(head, found)


if __name__ == "__main__":
    raise SystemExit(main())
