"""Particles that have clumped: a pair so near that it moves as one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np
from jaxtyping import Float

from .cloud import Cloud
from .domain import Box
from .pairs import Space
from .trajectory import Snapshot

CLUMPED = 0.1  # times dx: evenly spread particles are 0.5 to 1 apart


def nearest(position: Float[np.ndarray, "particles dim"], box: Box) -> float:
    """The least distance between two particles [m], periodic images included.

    Examples:
        >>> import numpy as np
        >>> import jaxsph
        >>> from jaxsph.clumping import nearest
        >>> box = jaxsph.Box.unit_periodic(2)
        >>> places = np.array([[0.0625, 0.5], [0.5, 0.5], [0.9375, 0.5]])
        >>> nearest(places, box)
        0.125
    """
    return float(Cloud(position, box).gaps().min(initial=np.inf))


@final
@dataclass(frozen=True)
class Clumping:
    """A watch of `simulate`: names a snapshot in which two particles are nearer than dx / 10.

    Such a pair answers pressure as one particle of twice the mass, and where the kernel is wide it
    stays together, while the fluid around it looks sound.

    Args:
        space: gives box and spacing.
    """

    space: Space

    def __call__(self, time: float, snapshot: Snapshot) -> str | None:
        """What is wrong with a snapshot, if particles have clumped."""
        apart = nearest(snapshot.in_flow().position, self.space.box) / self.space.spacing
        if apart >= CLUMPED:
            return None
        width = self.space.smoothing_length / self.space.spacing
        return (
            f"particles have clumped, two are {apart:.2g} dx apart and move as one (h/dx is "
            f"{width:.3g}: a smaller one, the consistent scheme or smaller steps keep them apart)"
        )
