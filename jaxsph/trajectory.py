"""Recorded particle fields."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .particles import ParticleState


class Snapshot(eqx.Module):
    """Particle fields at one time: position [m], velocity [m/s], density [kg/m^3], pressure [Pa].

    `coordinates` are the reduced coordinates where a reduced model made the snapshot.
    """

    position: Float[Array, "*times particles dim"]
    velocity: Float[Array, "*times particles dim"]
    density: Float[Array, "*times particles"]
    pressure: Float[Array, "*times particles"]
    coordinates: Float[Array, "*times modes"] | None = None


class Trajectory(eqx.Module):
    """Snapshots over time, as `simulate` returns and `io.read_trajectory` reads them.

    Args:
        time: (S,) [s].
        position, velocity: (S, N, n) [m], [m/s].
        density, pressure: (S, N) [kg/m^3], [Pa].
        coordinates: (S, M) of a reduced model, else None.
        metadata: scene, parameters, time step, timings; JSON-like.
    """

    time: Float[np.ndarray, " times"]
    position: Float[np.ndarray, "times particles dim"]
    velocity: Float[np.ndarray, "times particles dim"]
    density: Float[np.ndarray, "times particles"]
    pressure: Float[np.ndarray, "times particles"]
    coordinates: Float[np.ndarray, "times modes"] | None = None
    metadata: dict[str, Any] = eqx.field(static=True, default_factory=dict)

    @property
    def particles(self) -> int:
        return self.position.shape[1]

    def nearest(self, time: float) -> int:
        """The number of the snapshot nearest to a time [s]."""
        return int(np.argmin(np.abs(self.time - time)))

    def state(self, number: int) -> ParticleState:
        """The particles of a snapshot, as a run can go on from them; -1 for the last."""
        fields = (self.position, self.velocity, self.density)
        return ParticleState(*(jnp.asarray(field[number]) for field in fields))
