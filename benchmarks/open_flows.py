"""What benchmarks of flows past bodies share: a run and its row, where a mean flow turns."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float

from jaxsph import SimulationError, Trajectory, run_scene
from jaxsph.environment import environment
from jaxsph.interpolation import MovingLeastSquaresMap
from jaxsph.scenes import Scene

from .measure import progress


def ran(scene: Scene, label: str, **recorded) -> tuple[Trajectory, dict[str, Any]]:
    """A run, shown as it goes, as far as it came; its size, times, density and fault. What is
    recorded beside it is `run_scene`'s to say."""
    fault = None
    with progress(label, scene.steps) as report:
        try:
            trajectory = run_scene(scene, progress=report, **recorded)
        except SimulationError as error:
            fault, trajectory = str(error), error.trajectory
    rest = float(scene.fluid.reference_density)
    return trajectory, {
        "particles": trajectory.particles,
        "steps": scene.steps,
        "seconds": trajectory.timing.run_seconds,
        "compile_seconds": trajectory.timing.compile_seconds,
        "density_deviation_percent": float(100.0 * np.abs(trajectory.density / rest - 1.0).max()),
        "fault": fault,
        "environment": environment(),
    }


def mean_along(
    scene: Scene,
    trajectory: Trajectory,
    of: Bool[np.ndarray, " times"],
    points: Float[np.ndarray, "points dim"],
) -> Float[np.ndarray, " points"]:
    """The velocity along the first axis [m/s] at points [m], mean over some snapshots."""
    there = eqx.filter_jit(MovingLeastSquaresMap.allocate(jnp.asarray(points), scene.space))
    along = []
    for k in np.flatnonzero(of):
        values, overflow = there(
            jnp.asarray(trajectory.position[k]),
            jnp.asarray(trajectory.velocity[k][:, :1]),
            None if trajectory.active is None else jnp.asarray(trajectory.active[k]),
        )
        along.append(np.full(len(points), np.nan) if overflow else np.asarray(values)[:, 0])
    return np.mean(along, axis=0)


def last_turn(place: Float[np.ndarray, " points"], mean: Float[np.ndarray, " points"]) -> float:
    """Where the mean last goes from below zero to above [m]; NaN if it nowhere does.

    Examples:
        >>> import numpy as np
        >>> from benchmarks.open_flows import last_turn
        >>> last_turn(np.array([0.0, 1.0, 2.0]), np.array([1.0, -1.0, 1.0]))
        1.5
    """
    turns = np.flatnonzero((mean[:-1] < 0.0) & (mean[1:] >= 0.0))
    if not len(turns):
        return float("nan")
    k = turns[-1]
    return float(place[k] + (place[k + 1] - place[k]) * mean[k] / (mean[k] - mean[k + 1]))
