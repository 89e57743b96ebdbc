"""Time of a right-hand side: all codes at the same particles, in turns."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from jaxsph.arrangements import JitteredLattice
from jaxsph.scenes import Scene, taylor_green
from jaxsph.schemes import DeltaPlus

from ..measure import interacting_pairs, progress, summary, tell
from .protocol import PLAIN
from .workers import OURS, Code, Worker, WorkerError, workers

_TURN = 0.2  # s, at least: calls are repeated so that a turn is not over in a few milliseconds


def speed_row(
    codes: list[Code], scheme: str, resolution: int, h_over_dx: float, options: argparse.Namespace
) -> dict[str, Any]:
    """One case: what each code computes, its times, and ratios to this library's."""
    scene = make_scene(resolution, h_over_dx, options.reynolds, JitteredLattice(seed=0))
    particles = len(scene.state.density)
    pairs = interacting_pairs(scene.state.position, scene.space)
    row: dict[str, Any] = {
        "scheme": scheme, "resolution": resolution, "particles": particles,
        "h_over_dx": h_over_dx, "neighbors": pairs / particles, "pairs": pairs, "failed": {},
    }  # fmt: skip
    with workers(codes) as (started, folder):
        case = write_case(folder, scene, scheme, options.end_time, slices=1)
        found = load_all(started, case, row["failed"])
        times = _alternate(started, options.repeats, row["failed"])
        rates = {name: _rates(w, folder) for name, w in started.items()} if scheme == PLAIN else {}
    row["codes"] = {
        name: found[name] | _figures(times[name], times[OURS], pairs, found[name]) for name in times
    }
    for name in rates.keys() - {OURS}:
        row["codes"][name] |= _differences(rates[name], rates[OURS])
    return row


def make_scene(resolution: int, h_over_dx: float, reynolds: float, arrangement) -> Scene:
    """The vortex whose particles all codes start from."""
    return taylor_green(resolution, reynolds, h_over_dx=h_over_dx, arrangement=arrangement,
        scheme=DeltaPlus())


def write_case(folder: Path, scene: Scene, scheme: str, end_time: float, slices: int) -> dict:
    """The particles in a file, and the arguments of `load`."""
    path, state = folder / "particles.npz", scene.state
    arrays = {name: getattr(state, name) for name in ("position", "velocity", "density")}
    np.savez(path, **{name: np.asarray(array) for name, array in arrays.items()})
    shared = ("resolution", "h_over_dx", "reynolds", "mach")
    return {name: scene.parameters[name] for name in shared} | {
        "particles": str(path),
        "scheme": scheme,
        "reference_density": float(scene.fluid.reference_density),
        "end_time": end_time,
        "slices": slices,
    }


def load_all(started: dict[str, Worker], case: dict, failed: dict[str, str]) -> dict[str, dict]:
    """Each code set up; one that fails is left out and its reason kept.

    Raises:
        ValueError: if this library's own side fails.
    """
    found = {}
    for name, worker in list(started.items()):
        try:
            found[name] = worker.ask("load", **case)
            tell(f"{name}: ready after {found[name]['setup_seconds']:.1f} s")
        except WorkerError as error:
            leave_out(started, name, error, failed)
    return found


def leave_out(started: dict[str, Worker], name: str, error: WorkerError, failed: dict) -> None:
    """Go on without a peer that failed."""
    if name == OURS:
        raise ValueError(str(error)) from None
    tell(f"left out: {error}")
    failed[name] = str(error)
    del started[name]


def _alternate(started: dict[str, Worker], repeats: int, failed: dict[str, str]) -> dict:
    """Replies of each code's turns, by kind of call; turns are taken in one order throughout."""
    times: dict[str, dict[str, list]] = {}
    counts: dict[tuple[str, str], int] = {}
    kinds = ("right_hand_side", "neighbors")
    with progress("turns", repeats) as report:
        for turn in range(-1, repeats):  # the first only says how many calls a turn takes
            for name, worker in list(started.items()):
                for kind in kinds:
                    try:
                        reply = worker.ask(kind, count=counts.get((name, kind), 3))
                    except WorkerError as error:
                        leave_out(started, name, error, failed)
                        times.pop(name, None)
                        break
                    if turn < 0:
                        counts[name, kind] = max(1, int(np.ceil(_TURN / reply["seconds"])))
                    else:
                        of_code = times.setdefault(name, {kind: [] for kind in kinds})
                        of_code[kind].append(reply)
            if turn >= 0:
                report(1)
    return times


def _figures(times: dict, ours: dict, pairs: int, found: dict) -> dict[str, Any]:
    """Times and ratios; those of a ratio's turns are next to one another in time."""
    seconds = {kind: [r["seconds"] for r in replies] for kind, replies in times.items()}
    busy = sum(r["busy"] for r in times["right_hand_side"])
    mine, reference = (
        np.asarray([r["seconds"] for r in t["right_hand_side"]]) for t in (times, ours)
    )
    low, middle, high = np.percentile(mine / reference, (25, 50, 75))
    middle_seconds = float(np.median(mine))
    return {
        "right_hand_side": summary(seconds["right_hand_side"]),
        "right_hand_side_busy_seconds": busy / len(mine),
        "cores_busy": busy / mine.sum(),
        "ns_per_pair": 1e9 * middle_seconds / pairs,
        "busy_ns_per_pair": 1e9 * busy / len(mine) / pairs,
        "neighbors": summary(seconds["neighbors"]),
        "ratio": middle,
        "ratio_quartiles": [low, high],
        "ratio_of_fastest": mine.min() / reference.min(),
        "ratio_busy": busy / sum(r["busy"] for r in ours["right_hand_side"]),
    }


def _rates(worker: Worker, folder: Path) -> dict[str, np.ndarray]:
    path = folder / "rates.npz"
    worker.ask("rates", path=str(path))
    with np.load(path) as arrays:
        return dict(arrays)


def _differences(theirs: dict[str, np.ndarray], ours: dict[str, np.ndarray]) -> dict[str, float]:
    """By how much rates of the plain scheme differ from this library's [percent, root mean square].

    Forms that agree but for factors rho_i / rho_j or 0.01 h^2 in a denominator are half a percent
    apart in accelerations, and a few percent in rates of density, which nearly vanish in this flow;
    more would mean that it is not the same physics that is timed.
    """
    norm = np.linalg.norm
    return {
        f"{name}_differs_percent": 100.0 * norm(theirs[name] - ours[name]) / norm(ours[name])
        for name in ours
    }
