"""PySPH's lid-driven cavity beside ours: the same lid, particles and measure.

    python -m benchmarks.peers.cavity --pysph-python ENV/bin/python

The example that PySPH ships, as it comes but for its size, Reynolds number and end, by its
transport-velocity scheme and by the scheme it recommends for internal flows, EDAC; on one core,
from rest for as long as `benchmarks.lid_driven_cavity --cases settled` has altogether. Centre lines
are judged as ours are; times are the processor's, which other work on the machine blurs less.
`python -m benchmarks.peers.setup` makes PySPH's environment. Finished rows are kept: the same
command goes on.
"""

from __future__ import annotations

import os
import subprocess
import tempfile
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from jaxsph.cli import positive_int
from jaxsph.environment import environment

from ..centre_lines import centre_line_errors
from ..measure import format_rows, number
from ..table import Table, command

KEY = ("scheme", "reynolds", "resolution", "end_time")
SCHEMES = ("tvf", "edac")
END_TIME = {100: 30.0, 400: 50.0, 1000: 100.0}  # s
SECONDS = 11.0  # that are judged: the last one, and how much it changed in ten


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: a run failed, 2: bad input."""
    return command("peers.cavity", __doc__, _arguments, _run, argv, json="peers_cavity.json")


def _arguments(add) -> None:
    add("--pysph-python", type=Path, required=True, metavar="PATH", help="the Python with PySPH")
    add("--resolution", type=positive_int, nargs="+", default=[32, 50], metavar="N",
        help="particles a side (default: 32 50)")  # fmt: skip
    add("--reynolds", type=int, choices=tuple(END_TIME), nargs="+", default=list(END_TIME),
        help="default: all")  # fmt: skip
    add("--schemes", choices=SCHEMES, nargs="+", default=list(SCHEMES), help="default: both")


def _run(options) -> bool:
    if not options.pysph_python.exists():
        raise ValueError(f"--pysph-python: there is no {options.pysph_python}.")
    kept = Table(options.json, KEY, beside=lambda rows: {"environment": environment()})
    cases = [
        dict(zip(KEY, (scheme, reynolds, resolution, END_TIME[reynolds]), strict=True))
        for resolution, scheme, reynolds in product(
            options.resolution, options.schemes, options.reynolds
        )
    ]
    for case in kept.left(cases):
        kept.add(case | run(options.pysph_python, case))
    print(_table(kept.rows))
    return any(row["fault"] for row in kept.rows)


def run(python: Path, case: dict[str, Any]) -> dict[str, Any]:
    """Errors on the centre lines and times of one run of PySPH."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "last.npz"
        words = (case["scheme"], case["resolution"], case["reynolds"], case["end_time"], SECONDS)
        done = subprocess.run(
            [python, Path(__file__).with_name("cavity_side.py"), *map(str, words),
             Path(folder) / "run", file],
            env=os.environ | {"OMP_NUM_THREADS": "1", "PYTHONPATH": ""},
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        if done.returncode:
            return {"fault": done.stderr.strip().rpartition("\n")[2]}
        found = dict(np.load(file))
    inside = np.isfinite(found["velocity"]).all()
    errors = (
        centre_line_errors(
            *(found[name] for name in ("time", "position", "velocity")),
            1.0 / case["resolution"],
            case["reynolds"],
            "constant",
        )
        if inside
        else {}
    )
    return {
        **errors,
        "fault": None if inside else "a velocity is not finite",
        "seconds": float(found["seconds"]),
        "time_step": float(found["time_step"]),
        "particles": found["position"].shape[1],
    }


def _table(rows: list[dict[str, Any]]) -> str:
    header = ("scheme", "Re", "side", "u %", "v %", "last change %", "CPU s", "fault")
    cells = [
        (
            row["scheme"], str(row["reynolds"]), str(row["resolution"]),
            *(number(row.get(f"{name}_percent")) for name in ("u_error", "v_error", "change")),
            number(row.get("seconds")), row["fault"] or "",
        )
        for row in rows
    ]  # fmt: skip
    return format_rows(header, cells)


if __name__ == "__main__":
    raise SystemExit(main())
