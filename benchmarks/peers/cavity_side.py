"""PySPH's own example of a lid-driven cavity, in its own Python: snapshots of the last seconds.

python cavity_side.py SCHEME N RE T SECONDS FOLDER FILE
"""

from __future__ import annotations

import sys
import time

import numpy as np
from pysph.examples.cavity import LidDrivenCavity
from pysph.solver.utils import load

SNAPSHOTS_PER_SECOND = 5


def main(scheme, resolution, reynolds, end_time, seconds, folder, file) -> None:
    """A run, and its last seconds in one file."""
    arguments = [
        *("--scheme", scheme, "--nx", resolution, "--re", reynolds, "--tf", end_time),
        *("--directory", folder, "--detailed-output"),
    ]
    step = time_step(int(resolution), float(reynolds))
    every = max(1, round(1.0 / (SNAPSHOTS_PER_SECOND * step)))
    app = LidDrivenCavity()
    before = time.process_time()
    app.run([*arguments, "--pfreq", str(every)])
    seconds_of_processor = time.process_time() - before
    data = [load(name) for name in app.output_files]
    times = np.array([float(one["solver_data"]["t"]) for one in data])
    last = np.flatnonzero(times > times[-1] - float(seconds))
    fluid = [data[k]["arrays"]["fluid"] for k in last]
    np.savez(
        file,
        time=times[last],
        position=np.array([np.stack([f.x, f.y], axis=1) for f in fluid]),
        velocity=np.array([np.stack([f.u, f.v], axis=1) for f in fluid]),
        seconds=seconds_of_processor,
        time_step=float(data[-1]["solver_data"]["dt"]),
    )


def time_step(resolution: int, reynolds: float) -> float:
    """The example's own: a quarter of h / (c0 + U), an eighth of h^2 / nu, h = dx."""
    return min(0.25 / resolution / 11.0, 0.125 * reynolds / resolution**2)


if __name__ == "__main__":
    main(*sys.argv[1:])
