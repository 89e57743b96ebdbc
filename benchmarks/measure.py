"""What all benchmarks share: timing, counting pairs, progress, and results as JSON."""

from __future__ import annotations

import json
import os
import resource
import sys
import time as clock
from collections.abc import Callable, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from tqdm import tqdm

from jaxsph import COMPILER_OPTIONS, Space, Trajectory
from jaxsph.cloud import Cloud
from jaxsph.scenes import Scene
from jaxsph_rom.report.plain import plain

_GIB = 2.0**30
_STUCK = 5.0  # s


def summary(seconds: list[float]) -> dict[str, float | int | None]:
    """Median, minimum and spread (interquartile range) of repeated times [s]."""
    if not seconds:
        return {"median": None, "min": None, "spread": None, "repeats": 0}
    low, middle, high = np.percentile(seconds, (25, 50, 75))
    spread = high - low
    return {"median": middle, "min": min(seconds), "spread": spread, "repeats": len(seconds)}


def compiled(
    function: Callable, *arguments, options: dict[str, Any] | None = COMPILER_OPTIONS
) -> tuple[Callable[[], Any], float]:
    """A call of the compiled function that blocks on its result, and its compile time [s]."""
    start = clock.perf_counter()
    program = jax.jit(function).lower(*arguments).compile(options)
    seconds = clock.perf_counter() - start
    return lambda: jax.block_until_ready(program(*arguments)), seconds


def repeated(call: Callable[[], Any], repeats: int) -> tuple[Any, float, list[float]]:
    """The result of a call, its first time [s] with compilation in it, and times of repeats [s]."""
    seconds = []
    for _ in range(1 + repeats):
        start = clock.perf_counter()
        found = jax.block_until_ready(call())
        seconds.append(clock.perf_counter() - start)
    return found, seconds[0], seconds[1:]


def alternate(
    calls: Mapping[str, Callable[[], Any]], repeats: int
) -> tuple[dict[str, list[float]], dict[str, list[float]]]:
    """Wall and process times [s] of calls made in turn, so that all see the same load.

    Every call is made once before, unmeasured.
    """
    for call in calls.values():
        call()
    wall: dict[str, list[float]] = {name: [] for name in calls}
    busy: dict[str, list[float]] = {name: [] for name in calls}
    with progress("repeats", repeats) as report:
        for _ in range(repeats):
            for name, call in calls.items():
                wall_start, busy_start = clock.perf_counter(), clock.process_time()
                call()
                wall[name].append(clock.perf_counter() - wall_start)
                busy[name].append(clock.process_time() - busy_start)
            report(1)
    return wall, busy


def interacting_pairs(position, space: Space) -> int:
    """Ordered pairs i != j of particles within the kernel's support of one another."""
    cloud = Cloud(position, space.box)
    return int(cloud.count_around(cloud.positions, space.support).sum()) - len(position)


def near_walls(scene: Scene, trajectory: Trajectory) -> dict[str, Any]:
    """Distances to walls and densities over all snapshots.

    A particle counts as stuck if it stays nearer than 0.25 dx to a wall for `_STUCK` seconds. (That
    none is beyond a wall is checked after every step of the run.)
    """
    walls, dx = scene.walls, scene.space.spacing
    distance = jax.jit(lambda t, x: -walls.at(t).signed_distance(x) / dx)
    snapshots = zip(trajectory.time, trajectory.position, strict=True)
    over_dx = np.stack([distance(jnp.asarray(t, x.dtype), jnp.asarray(x)) for t, x in snapshots])
    if trajectory.active is not None:
        over_dx = np.where(trajectory.active, over_dx, np.inf)
    near = over_dx < 0.25
    longest, lasting = np.zeros(near.shape[1], int), np.zeros(near.shape[1], int)
    for row in near:
        lasting = np.where(row, lasting + 1, 0)
        longest = np.maximum(longest, lasting)
    every = float(trajectory.time[1] - trajectory.time[0])
    ratio = trajectory.density / float(scene.fluid.reference_density)
    return {
        "nearest_to_wall_over_dx": float(over_dx.min()),
        "beyond_wall": int((over_dx < 0.0).sum()),
        "longest_stay_within_quarter_dx": float(longest.max() * every),
        "stuck": int((longest * every >= _STUCK).sum()),
        "density_low": float(ratio.min()),
        "density_high": float(ratio.max()),
    }


def peak_memory_gib() -> float:
    """The most memory [GiB] that this process has held so far."""
    unit = 1 if sys.platform == "darwin" else 1024  # of ru_maxrss [bytes]
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / _GIB


@contextmanager
def progress(label: str, total: int, done: int = 0):
    """A progress bar on stderr; gives the function to report steps to."""
    interval = 0.1 if sys.stderr.isatty() else 10.0  # spare log files
    with tqdm(desc=label, total=total, initial=done, file=sys.stderr, mininterval=interval) as bar:
        yield bar.update


class Clocked:
    """Progress bars that keep the time per step of the last run (none if it was read from disk)."""

    def __init__(self):
        self.seconds: list[float] = []

    def take(self) -> list[float]:
        """The times since they were last taken."""
        taken, self.seconds = self.seconds, []
        return taken

    @contextmanager
    def progress(self, label, total, done):
        self.seconds = []  # of this run only
        last = None
        with progress(label, total, done) as report:

            def mark(steps):
                nonlocal last
                now = clock.perf_counter()
                if last is not None:  # the first part would count compilation
                    self.seconds.append((now - last) / steps)
                last = now
                report(steps)

            yield mark


def tell(message: str) -> None:
    """A line of progress on stderr."""
    print(message, file=sys.stderr, flush=True)


def read_json(path: Path) -> dict[str, Any] | None:
    """What an earlier run wrote, or None.

    Raises:
        ValueError: if the file holds something else.
    """
    if not path.exists():
        return None
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise ValueError(f"{path}: not JSON ({error}); name another file.") from None
    if not isinstance(found, dict):
        raise ValueError(f"{path}: does not hold results; name another file.")
    return found


def write_json(path: Path, results: Mapping[str, Any]) -> None:
    """Write strict JSON, whole or not at all; NaN and infinity become null."""
    text = json.dumps(plain(results), indent=2, allow_nan=False) + "\n"
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        unfinished.write_text(text, encoding="utf-8")
        os.replace(unfinished, path)
    finally:
        unfinished.unlink(missing_ok=True)


def format_rows(header: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """An aligned table, every column to the right."""
    widths = [max(map(len, column)) for column in zip(header, *rows, strict=True)]
    lines = [
        "  ".join(f"{c:>{w}}" for c, w in zip(r, widths, strict=True)) for r in (header, *rows)
    ]
    return "\n".join([lines[0], "-" * len(lines[0]), *lines[1:]])


def number(value: float | None, digits: int = 3) -> str:
    """A number to a few significant digits; a dash for none."""
    return "-" if value is None or not np.isfinite(value) else f"{value:.{digits}g}"
