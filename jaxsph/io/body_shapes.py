"""The shapes of free bodies, as files keep them and pictures draw them."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from jaxtyping import Float, Int
from scipy.spatial.transform import Rotation

from ..body_state import BodyState
from ..trajectory import Snapshot
from ..walls import Walls
from .trajectory_file import opened, patient, read_walls


@dataclass(frozen=True)
class BodyShapes:
    """Where the ghosts of free bodies are about their centres.

    Args:
        arm: of each ghost from its body's centre of mass, where the body has not turned (G, n) [m].
        owner: the number of its body (G,).
    """

    arm: Float[np.ndarray, "ghosts dim"]
    owner: Int[np.ndarray, " ghosts"]

    @classmethod
    def of(cls, walls: Walls | None) -> BodyShapes | None:
        """Those of walls at the start of a run; None if they have no free body."""
        free = None if walls is None else walls.free
        if free is None:
            return None
        owner = np.asarray(free.owner)
        own = owner < len(free.parts)
        owner = owner[own]
        center = np.asarray(free.state.position)
        return cls(np.asarray(walls.position)[own] - center[owner], owner)

    def places(self, bodies: BodyState) -> Float[np.ndarray, "ghosts dim"]:
        """Where the ghosts are [m] when the bodies are in a state."""
        angle = np.array(bodies.angle)[self.owner]
        if self.arm.shape[1] == 2:
            angle = angle[:, None] * np.array([0.0, 0.0, 1.0])
        arm = np.pad(self.arm, ((0, 0), (0, 3 - self.arm.shape[1])))
        arm = Rotation.from_rotvec(angle).apply(arm)[:, : self.arm.shape[1]]
        return np.asarray(bodies.position)[self.owner] + arm


def begin_shapes(file: h5py.File, walls: Walls) -> None:
    """Datasets `walls/body_arm` and `walls/body_owner`, if there are free bodies."""
    shapes = BodyShapes.of(walls)
    if shapes is not None:
        file["walls/body_arm"] = np.float32(shapes.arm)
        file["walls/body_owner"] = np.int32(shapes.owner)


@patient
def read_body_shapes(path: str | os.PathLike) -> BodyShapes | None:
    """The shapes of the free bodies of a run; None where there are none.

    Raises:
        TrajectoryFileError: if the file is not a whole trajectory file.
    """
    with opened(Path(path)) as (file, _):
        if "walls/body_arm" not in file:
            return None
        return BodyShapes(file["walls/body_arm"][:], file["walls/body_owner"][:])


def walls_with_bodies(
    walls: np.ndarray | None, shapes: BodyShapes | None, bodies: BodyState | None
) -> np.ndarray | None:
    """Places of the fixed walls' ghosts and of the free bodies' (G, n) [m]."""
    if shapes is None or bodies is None:
        return walls
    places = shapes.places(bodies)
    return places if walls is None else np.concatenate([walls, places.astype(walls.dtype)])


def read_walls_of(
    path: str | os.PathLike, snapshot: Snapshot
) -> Float[np.ndarray, "ghosts dim"] | None:
    """Places of the ghosts of a run's walls [m], those of its free bodies as a snapshot has them.

    Raises:
        TrajectoryFileError: if the file is not a whole trajectory file.
    """
    return walls_with_bodies(read_walls(path), read_body_shapes(path), snapshot.bodies)


def told_bodies(file: h5py.File, count: int) -> tuple[dict[str, Any], ...]:
    """Of each free body its last state, and how far its centre has come in each direction."""
    if "bodies" not in file or not count:
        return ()
    last = {name: file[f"bodies/{name}"][count - 1] for name in file["bodies"]}
    position = file["bodies/position"][:count]
    return tuple(
        {
            **{name: values[number].tolist() for name, values in last.items()},
            "lowest": position[:, number].min(axis=0).tolist(),
            "highest": position[:, number].max(axis=0).tolist(),
        }
        for number in range(position.shape[1])
    )
