"""Trajectory files of random snapshots, made without running anything."""

import numpy as np

from jaxsph.arrangements import Lattice
from jaxsph.io import TrajectoryWriter
from jaxsph.scenes import taylor_green, taylor_green_3d
from jaxsph.trajectory import Snapshot


def random_run(path, count=5, dim=2, finish=False, **options):
    """A file of `count` snapshots, two steps apart, of a small Taylor-Green vortex.

    A complete one has `count` - 1 intervals; else the run was to go on for longer.
    """
    make = taylor_green if dim == 2 else taylor_green_3d
    scene = make(16, arrangement=Lattice(), time_step=0.01, **options)
    rng = np.random.default_rng(count)
    start = np.asarray(scene.state.position)
    with TrajectoryWriter.create(path, scene) as writer:
        for k in range(count):
            position = (start + 1e-3 * rng.normal(size=start.shape)).astype(start.dtype)
            velocity = rng.normal(size=start.shape).astype(start.dtype)
            density = (1000.0 + rng.normal(size=len(start))).astype(start.dtype)
            pressure = (100.0 * rng.normal(size=len(start))).astype(start.dtype)
            step = k * scene.steps_per_snapshot
            writer.append(step, step * scene.time_step, Snapshot(
                position, velocity, density, pressure))  # fmt: skip
        if finish:
            writer.finish({"scene": scene.name, "run_seconds": 1.5})
    return path
