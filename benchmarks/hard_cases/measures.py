"""What hard cases are judged by: figures of a trajectory, and the bounds set to them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from jaxsph import Space, Trajectory
from jaxsph.cloud import Cloud
from jaxsph.metrics import kinetic_energy
from jaxsph.scenes import Scene
from jaxsph.scenes.hydrostatic_tank import GRAVITY, hydrostatic_pressure

from ..measure import near_walls

_LOOKED_AT = 21  # snapshots, evenly spread over a run, that disorder is measured in

Measure = Callable[[Scene, Trajectory], float]


@dataclass(frozen=True)
class Bound:
    """measure <= limit, or measure >= limit where that is `at_least`. A NaN keeps no bound.

    Args:
        name: as results name it.
        measure: of a scene and its trajectory.
        limit: the bound.
        reason: why it is this large.
        at_least: whether the limit is a lower one.
    """

    name: str
    measure: Measure
    limit: float
    reason: str
    at_least: bool = False

    def kept(self, value: float) -> bool:
        """Whether a value is within the bound."""
        return value >= self.limit if self.at_least else value <= self.limit

    def used(self, value: float) -> float:
        """The share of the bound that a value takes up: 0 is far from it, 1 is at it."""
        if value == self.limit:
            return 0.0 if self.limit == 0.0 else 1.0
        above, below = (self.limit, value) if self.at_least else (value, self.limit)
        return above / below if below else math.inf


def density_deviation(scene: Scene, trajectory: Trajectory) -> float:
    """max |rho / rho0 - 1| over particles and time."""
    ratio = np.float64(trajectory.density) / float(scene.fluid.reference_density)
    return float(np.abs(ratio - 1.0).max())


def energy_over_start(scene: Scene, trajectory: Trajectory) -> float:
    """max_t E(t) / E(0), E the kinetic energy."""
    energy = kinetic_energy(np.float64(trajectory.velocity), float(scene.mass))
    return float(energy.max() / energy[0])


def energy_left(scene: Scene, trajectory: Trajectory) -> float:
    """E(end) / E(0), E the kinetic energy."""
    energy = kinetic_energy(np.float64(trajectory.velocity), float(scene.mass))
    return float(energy[-1] / energy[0])


def energy_change(scene: Scene, trajectory: Trajectory) -> float:
    """max_t |E(t) / E(0) - 1|, E the kinetic energy."""
    energy = kinetic_energy(np.float64(trajectory.velocity), float(scene.mass))
    return float(np.abs(energy / energy[0] - 1.0).max())


def energy_over_reference(scene: Scene, trajectory: Trajectory) -> float:
    """max_t E(t) / (N m U^2 / 2): over that of the fluid all moving at the reference speed."""
    mean = (np.float64(trajectory.velocity) ** 2).sum(axis=2).mean(axis=1)
    return float(mean.max() / float(scene.fluid.reference_speed) ** 2)


def highest_speed(scene: Scene, trajectory: Trajectory) -> float:
    """max |u| / U over particles and time, U the reference speed."""
    speed = np.linalg.norm(np.float64(trajectory.velocity), axis=2)
    return float(speed.max() / float(scene.fluid.reference_speed))


def momentum_drift(scene: Scene, trajectory: Trajectory) -> float:
    """max_t |sum_i m u_i(t) - sum_i m u_i(0)| / (N m U)."""
    mean = np.float64(trajectory.velocity).mean(axis=1)
    drift = np.linalg.norm(mean - mean[0], axis=1)
    return float(drift.max() / float(scene.fluid.reference_speed))


def hydrostatic_error(scene: Scene, trajectory: Trajectory) -> float:
    """max |p - rho0 g (H - y)| / (rho0 g H) over particles and time, H = 1 m."""
    density = float(scene.fluid.reference_density)
    expected = hydrostatic_pressure(trajectory.position.reshape(-1, trajectory.position.shape[2]))
    error = np.abs(np.float64(trajectory.pressure).reshape(-1) - expected).max()
    return float(error / (density * GRAVITY))


def least_distance(scene: Scene, trajectory: Trajectory) -> float:
    """The least distance of two particles over dx, in any of the snapshots looked at."""
    return float(min(d.min() for d in _each(_nearest, scene, trajectory)))


def unevenness(scene: Scene, trajectory: Trajectory) -> float:
    """The largest spread (standard deviation) over time of nearest neighbours' distances, in dx."""
    return float(max(d.std() for d in _each(_nearest, scene, trajectory)))


def volume_spread(scene: Scene, trajectory: Trajectory) -> float:
    """The largest spread over time of sum_j W_ij dx^n, itself included: 0 on a lattice."""
    return float(max(s.std() for s in _each(_kernel_sums, scene, trajectory)))


def beyond_walls(scene: Scene, trajectory: Trajectory) -> float:
    """How many particles are beyond a wall, counted over all snapshots."""
    return float(near_walls(scene, trajectory)["beyond_wall"])


def _each(function, scene: Scene, trajectory: Trajectory):
    """A function of space and positions, at snapshots spread over the run."""
    count = len(trajectory.time)
    for k in np.unique(np.linspace(0, count - 1, min(count, _LOOKED_AT)).round().astype(int)):
        yield function(scene.space, np.float64(trajectory.snapshot(k).in_flow().position))


def _nearest(space: Space, position: np.ndarray) -> Float[np.ndarray, " particles"]:
    """Distances to nearest neighbours, in dx."""
    return Cloud(position, space.box).gaps() / space.spacing


def _kernel_sums(space: Space, position: np.ndarray) -> Float[np.ndarray, " particles"]:
    """sum_j W_ij dx^n, itself included."""
    pairs = Cloud(position, space.box).pairs(space.support)
    apart = space.box.displacement(*(jnp.asarray(position[side]) for side in pairs.T))
    distance = np.linalg.norm(np.asarray(apart), axis=1)
    itself = np.zeros(1)
    values = np.asarray(
        space.kernel.value(
            jnp.asarray(np.append(itself, distance)), space.smoothing_length, space.box.dim
        )
    )
    each = sum(np.bincount(side, values[1:], len(position)) for side in pairs.T)
    return (values[0] + each) * space.spacing**space.box.dim
