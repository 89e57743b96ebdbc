"""How a run goes over time: its energy, its densities, its fastest particle."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from .io import snapshot_blocks
from .metrics import kinetic_energy

_BLOCK_BYTES = 2**24  # of fields held at once, about
_NUMBERS = 6  # a particle has in two dimensions; eight in three


@dataclass(frozen=True)
class History:
    """Sums and extremes over all particles at each of S snapshots.

    Args:
        time: (S,) [s].
        kinetic_energy: (S,) of all particles [J], of a metre's depth in two dimensions [J/m].
        lowest_density, highest_density: (S,) [kg/m^3].
        highest_speed: (S,) [m/s].
    """

    time: Float[np.ndarray, " times"]
    kinetic_energy: Float[np.ndarray, " times"]
    lowest_density: Float[np.ndarray, " times"]
    highest_density: Float[np.ndarray, " times"]
    highest_speed: Float[np.ndarray, " times"]


def energy_unit(dim: int) -> str:
    """Of an energy in `dim` dimensions: that of a metre's depth in two."""
    return "J" if dim == 3 else "J/m"


def read_history(
    path: str | os.PathLike,
    particles: int,
    mass: float,
    every: int = 1,
    progress: Callable[[int], None] | None = None,
) -> History:
    """The history of the run in a file, read some snapshots at a time.

    Args:
        path: of the trajectory file.
        particles: how many there are, for the size of what is held at once.
        mass: of a particle [kg].
        every: take every N-th snapshot, from the first on.
        progress: is called with the number of snapshots read since its last call.

    Raises:
        TrajectoryFileError: if the file is not a whole trajectory file with a snapshot in it.
    """
    size = max(1, _BLOCK_BYTES // (8 * _NUMBERS * particles))
    parts = []
    for block in snapshot_blocks(path, size, every):
        velocity = block.velocity.astype(np.float64)
        active = True if block.active is None else block.active
        parts.append(
            (
                block.time,
                kinetic_energy(velocity, mass),
                np.where(active, block.density, np.inf).min(axis=1),
                np.where(active, block.density, -np.inf).max(axis=1),
                np.sqrt((velocity**2).sum(axis=2).max(axis=1)),
            )
        )
        if progress is not None:
            progress(len(block.time))
    return History(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))
