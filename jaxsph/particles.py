"""What a particle carries, and what is recorded of it."""

from __future__ import annotations

import equinox as eqx
from jaxtyping import Array, Float


class ParticleState(eqx.Module):
    """Positions [m], velocities [m/s] and densities [kg/m^3] of N particles; also their rates."""

    position: Float[Array, "particles dim"]
    velocity: Float[Array, "particles dim"]
    density: Float[Array, " particles"]
