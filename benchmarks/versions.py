"""What this version takes beside an earlier one, in turns on one machine.

    git worktree add ../earlier COMMIT
    python -m benchmarks.versions ../earlier

One delta-plus right-hand side in a periodic box and between walls, `predict` of tensors for one
member, and a sweep of ten thousand: each version is a process of its own, and they are asked in
turns. Least times, and their ratios.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from jaxsph.cli import positive_int
from jaxsph.environment import environment

from .measure import format_rows, number, write_json
from .table import command

ROOT = Path(__file__).parents[1]
WORKER = Path(__file__).with_name("version_worker.py")
CASES = ("periodic right-hand side", "walled right-hand side", "predict, one member", "sweep")


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 2: bad input."""
    return command("versions", __doc__, _arguments, _run, argv)


def _arguments(add) -> None:
    add("earlier", type=Path, help="folder of the earlier version")
    add("--rounds", type=positive_int, default=10, metavar="K", help="default: %(default)s")


def _run(options) -> None:
    if not (options.earlier / "jaxsph").is_dir():
        raise ValueError(f"earlier: {options.earlier} holds no jaxsph; name a working tree of it.")
    with _worker(options.earlier.resolve()) as earlier, _worker(ROOT) as this:
        rows = []
        for case in CASES:
            seconds = [[ask(case) for ask in (earlier, this)] for _ in range(options.rounds)]
            before, after = np.min(seconds, axis=0)
            rows.append({"case": case, "earlier_seconds": before, "seconds": after,
                         "ratio": after / before})  # fmt: skip
    commit = subprocess.run(
        ["git", "-C", options.earlier, "rev-parse", "--short", "HEAD"],
        capture_output=True, text=True, check=False,
    ).stdout.strip()  # fmt: skip
    results = {"rows": rows, "earlier": commit or "unknown", "environment": environment()}
    write_json(options.json, results)
    print(format_rows(
        ("case", "earlier ms", "this ms", "ratio"),
        [(row["case"], number(1e3 * row["earlier_seconds"]), number(1e3 * row["seconds"]),
          number(row["ratio"])) for row in rows],
    ))  # fmt: skip


@contextmanager
def _worker(tree: Path) -> Iterator[Callable[[str], float]]:
    """A version as a process that is asked for the seconds of a case."""
    process = subprocess.Popen(
        [sys.executable, WORKER], cwd=tree, text=True,
        env={**os.environ, "PYTHONPATH": str(tree)}, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
    )  # fmt: skip

    def ask(case: str) -> float:
        process.stdin.write(case + "\n")
        process.stdin.flush()
        for line in process.stdout:
            if line.startswith("{"):
                return json.loads(line)["seconds"]
        raise ValueError(f"earlier: the version in {tree} ended before it answered; see above.")

    try:
        yield ask
    finally:
        process.stdin.close()
        process.wait()


if __name__ == "__main__":
    raise SystemExit(main())
