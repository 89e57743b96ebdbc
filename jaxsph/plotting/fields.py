"""Fields of particles that figures show, and the colours of each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..trajectory import Snapshot, Trajectory
from .style import MAGNITUDE_MAP, SIGNED_MAP
from .vorticity import vorticity

_MATTERS = 0.1  # a sign does, if it reaches so far of the way that the other one does


@dataclass(frozen=True)
class ParticleField:
    """A number of each particle.

    Args:
        name: as users type it.
        label: with its unit, for a colour bar.
        value: takes it from a snapshot, (N,), or from a trajectory, (S, N).
        signed: whether zero is in its middle where both signs matter.
    """

    name: str
    label: str
    value: Callable[[Snapshot | Trajectory], np.ndarray]
    signed: bool = False

    def colours(self, low: float, high: float) -> tuple[str, tuple[float, float]]:
        """Colour map and its limits for values from low to high."""
        if self.signed and min(-low, high) > _MATTERS * max(-low, high):
            high = max(-low, high)
            return SIGNED_MAP, (-high, high)
        if not high > low:  # one value only, a quiet start say
            spread = 1e-3 * abs(low) or 1.0
            low, high = low - spread, high + spread
        return MAGNITUDE_MAP, (low, high)


def _of_each(source: Snapshot | Trajectory) -> np.ndarray:
    """Vorticity of a snapshot, or of each one of a trajectory."""
    position, velocity = np.asarray(source.position), np.asarray(source.velocity)
    if position.ndim == 2:
        return vorticity(position, velocity)
    return np.stack([vorticity(x, u) for x, u in zip(position, velocity, strict=True)])


VELOCITY = ParticleField(
    "velocity", "velocity norm [m/s]", lambda s: np.linalg.norm(s.velocity, axis=-1)
)
PRESSURE = ParticleField("pressure", "pressure [Pa]", lambda s: np.asarray(s.pressure), signed=True)
DENSITY = ParticleField("density", "density [kg/m$^3$]", lambda s: np.asarray(s.density))
VORTICITY = ParticleField("vorticity", "vorticity [1/s]", _of_each, signed=True)
FIELDS = {field.name: field for field in (VELOCITY, PRESSURE, DENSITY, VORTICITY)}
