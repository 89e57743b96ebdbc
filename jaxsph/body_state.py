"""Where bodies that are free are, and how they move."""

from __future__ import annotations

import equinox as eqx
from jaxtyping import Array, Float


class BodyState(eqx.Module):
    """Centre of mass [m], angle [rad], velocity [m/s] and spin [rad/s] of F bodies; also their
    rates.

    Args:
        position: of the centres of mass.
        angle: by which each has turned since the start of its run: counterclockwise, turns counted,
            in two dimensions; in three the axis of the turn times its angle, at most pi, (..., 3).
        velocity: of the centres of mass.
        spin: in two dimensions the rate of the angle; in three the angular velocity, in the axes of
            the box, (..., 3).
    """

    position: Float[Array, "*times bodies dim"]
    angle: Float[Array, "*times bodies ..."]
    velocity: Float[Array, "*times bodies dim"]
    spin: Float[Array, "*times bodies ..."]
