"""Where bodies that are free are, and how they move."""

from __future__ import annotations

import equinox as eqx
from jaxtyping import Array, Float


class BodyState(eqx.Module):
    """Centre of mass [m], angle [rad], velocity [m/s] and spin [rad/s] of F bodies in two
    dimensions; also their rates.

    Args:
        position: of the centres of mass.
        angle: by which each has turned since the start of its run, counterclockwise.
        velocity: of the centres of mass.
        spin: rate of the angle.
    """

    position: Float[Array, "*times bodies dim"]
    angle: Float[Array, "*times bodies"]
    velocity: Float[Array, "*times bodies dim"]
    spin: Float[Array, "*times bodies"]
