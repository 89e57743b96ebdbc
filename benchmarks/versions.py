"""What this version takes beside an earlier one, in turns on one machine.

    git worktree add ../earlier COMMIT
    python -m benchmarks.versions ../earlier

One delta-plus right-hand side in a periodic box and between walls, `predict` of tensors for one
member, and a sweep of ten thousand; then lists and whole steps of a vortex, a dam break and a
cavity, and what share of a step its lists take. Each version is a process of its own, and they are
asked in turns. Least times, least times of the processor, and their ratios. The same command goes
on where it was cut.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from jaxsph.cli import positive_int
from jaxsph.environment import environment

from .measure import format_rows, number
from .table import Table, command

ROOT = Path(__file__).parents[1]
WORKER = Path(__file__).with_name("version_worker.py")
FLOWS = ("vortex", "dam-break", "cavity")
CASES = ("periodic right-hand side", "walled right-hand side", "predict, one member", "sweep")


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 2: bad input."""
    return command("versions", __doc__, _arguments, _run, argv)


def _arguments(add) -> None:
    add("earlier", type=Path, help="folder of the earlier version")
    add("--particles", type=positive_int, nargs="+", default=[10_000, 100_000], metavar="N",
        help="of lists and steps (default: 10000 100000)")  # fmt: skip
    add("--rounds", type=positive_int, default=10, metavar="K", help="default: %(default)s")


def _run(options) -> None:
    if not (options.earlier / "jaxsph").is_dir():
        raise ValueError(f"earlier: {options.earlier} holds no jaxsph; name a working tree of it.")
    commit = subprocess.run(
        ["git", "-C", options.earlier, "rev-parse", "--short", "HEAD"],
        capture_output=True, text=True, check=False,
    ).stdout.strip()  # fmt: skip
    settings = {"earlier": commit or "unknown", "rounds": options.rounds}
    table = Table(options.json, ("case",), settings, lambda rows: {"environment": environment()})
    flows = [f"{flow} {n} {what}" for n in options.particles for flow in FLOWS
             for what in ("list", "steps")]  # fmt: skip
    with _worker(options.earlier.resolve()) as earlier, _worker(ROOT) as this:
        for case in table.left({"case": case} for case in (*CASES, *flows)):
            table.add(case | _measured(case["case"], (earlier, this), options.rounds, table.rows))
    print(format_rows(
        ("case", "earlier ms", "this ms", "ratio", "of CPU time", "lists' share"),
        [(row["case"], number(1e3 * row["earlier_seconds"]), number(1e3 * row["seconds"]),
          number(row["ratio"]), number(row["cpu_ratio"]), number(row["list_share"]))
         for row in table.rows],
    ))  # fmt: skip


def _measured(case: str, versions, rounds: int, rows) -> dict[str, Any]:
    """Least times of a case by both versions, and of steps the share that building lists takes."""
    found = [[ask(case) for ask in versions] for _ in range(rounds)]
    before, after = np.min([[a["seconds"] for a in both] for both in found], axis=0)
    cpu_before, cpu_after = np.min([[a["cpu_seconds"] for a in both] for both in found], axis=0)
    built, share = found[0][1]["rebuilds"], None
    if built is not None:
        alone = next(row for row in rows if row["case"] == case.replace("steps", "list"))
        share = built * alone["cpu_seconds"] / cpu_after
    return {
        "earlier_seconds": before, "seconds": after, "ratio": after / before,
        "earlier_cpu_seconds": cpu_before, "cpu_seconds": cpu_after,
        "cpu_ratio": cpu_after / cpu_before, "lists": built, "list_share": share,
    }  # fmt: skip


@contextmanager
def _worker(tree: Path) -> Iterator[Callable[[str], dict[str, Any]]]:
    """A version as a process that is asked for the times of a case."""
    process = subprocess.Popen(
        [sys.executable, WORKER], cwd=tree, text=True,
        env={**os.environ, "PYTHONPATH": str(tree)}, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
    )  # fmt: skip

    def ask(case: str) -> float:
        process.stdin.write(case + "\n")
        process.stdin.flush()
        for line in process.stdout:
            if line.startswith("{"):
                return json.loads(line)
        raise ValueError(f"earlier: the version in {tree} ended before it answered; see above.")

    try:
        yield ask
    finally:
        process.stdin.close()
        process.wait()


if __name__ == "__main__":
    raise SystemExit(main())
