"""Recorded particle fields."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from .body_state import BodyState
from .particles import ParticleState
from .shown import concrete, line, spread, table
from .timing import Timing


class Snapshot(eqx.Module):
    """Particle fields at one time: position [m], velocity [m/s], density [kg/m^3], pressure [Pa].

    `coordinates` are the reduced coordinates where a reduced model made the snapshot; `forces` (n,)
    [N] and `torques` [N m] those of the fluid on its walls and their named parts, where measured,
    `mean_forces` and `mean_torques` their means over the time since the snapshot before; `bodies`
    the state of free bodies, where there are any; `active` which particles are in the flow and not
    parked, where there are openings.
    """

    position: Float[Array, "*times particles dim"]
    velocity: Float[Array, "*times particles dim"]
    density: Float[Array, "*times particles"]
    pressure: Float[Array, "*times particles"]
    coordinates: Float[Array, "*times modes"] | None = None
    forces: dict[str, Array] = eqx.field(default_factory=dict)
    torques: dict[str, Array] = eqx.field(default_factory=dict)
    mean_forces: dict[str, Array] = eqx.field(default_factory=dict)
    mean_torques: dict[str, Array] = eqx.field(default_factory=dict)
    bodies: BodyState | None = None
    active: Bool[Array, "*times particles"] | None = None

    def in_flow(self) -> Snapshot:
        """A single snapshot with those particles alone that are in the flow (outside jit)."""
        if self.active is None:
            return self
        held = np.asarray(self.active)
        position, velocity, density, pressure = (
            np.asarray(field)[held]
            for field in (self.position, self.velocity, self.density, self.pressure)
        )
        return eqx.tree_at(
            lambda s: (s.position, s.velocity, s.density, s.pressure, s.active),
            self,
            (position, velocity, density, pressure, None),
            is_leaf=lambda leaf: leaf is None,
        )


class Trajectory(eqx.Module):
    """Snapshots over time, as `simulate` returns and `io.read_trajectory` reads them.

    Args:
        time: (S,) [s].
        position, velocity: (S, N, n) [m], [m/s].
        density, pressure: (S, N) [kg/m^3], [Pa].
        coordinates: (S, M) of a reduced model, else None.
        forces: (S, n) [N] of the fluid on its walls (`"walls"`) and on each named part of them, by
            name, of a metre's depth in two dimensions; empty where none were measured.
        torques: the same [N m], about the origin, (S,) in two dimensions and (S, 3) in three.
        mean_forces, mean_torques: their means over the time since the snapshot before, of every
            stage of every step; the first ones those of its instant.
        metadata: scene, parameters, and what the run took; JSON-like.
        bodies: the state of free bodies (S, F, ...), where there are any.
        active: (S, N), which particles are in the flow, where some come in or go out; None where
            all are.
    """

    time: Float[np.ndarray, " times"]
    position: Float[np.ndarray, "times particles dim"]
    velocity: Float[np.ndarray, "times particles dim"]
    density: Float[np.ndarray, "times particles"]
    pressure: Float[np.ndarray, "times particles"]
    coordinates: Float[np.ndarray, "times modes"] | None = None
    forces: dict[str, Float[np.ndarray, "times dim"]] = eqx.field(default_factory=dict)
    torques: dict[str, Float[np.ndarray, "times ..."]] = eqx.field(default_factory=dict)
    mean_forces: dict[str, Float[np.ndarray, "times dim"]] = eqx.field(default_factory=dict)
    mean_torques: dict[str, Float[np.ndarray, "times ..."]] = eqx.field(default_factory=dict)
    metadata: dict[str, Any] = eqx.field(static=True, default_factory=dict)
    bodies: BodyState | None = None
    active: Bool[np.ndarray, "times particles"] | None = None

    @property
    def particles(self) -> int:
        return self.position.shape[1]

    @property
    def timing(self) -> Timing:
        """What the run took.

        Raises:
            ValueError: if `metadata` are not those of a run.
        """
        return Timing.of(self.metadata)

    def nearest(self, time: float) -> int:
        """The number of the snapshot nearest to a time [s]."""
        return int(np.argmin(np.abs(self.time - time)))

    def state(self, number: int) -> ParticleState:
        """The particles of a snapshot, as a run can go on from them; -1 for the last."""
        fields = (self.position, self.velocity, self.density)
        fields = (*fields, self.bodies)
        return ParticleState(*jax.tree.map(lambda field: jnp.asarray(field[number]), fields))

    def snapshot(self, number: int) -> Snapshot:
        """A snapshot by its number; -1 for the last."""
        coordinates = None if self.coordinates is None else self.coordinates[number]
        fields = (self.position, self.velocity, self.density, self.pressure)
        of_all = (self.forces, self.torques, self.mean_forces, self.mean_torques)
        loads = ({k: v[number] for k, v in each.items()} for each in of_all)
        bodies = jax.tree.map(lambda field: field[number], self.bodies)
        active = None if self.active is None else self.active[number]
        return Snapshot(*(field[number] for field in fields), coordinates, *loads, bodies, active)

    # What follows imports inside, since plotting and io import this module.

    def plot(self, time: float | None = None, **options: Any) -> Any:
        """A figure of the snapshot nearest to a time; its `savefig` writes it to a file.

        Args:
            time: [s]; the end if none is given.
            options: of `jaxsph.plotting.snapshot_figure`: `fields`; `walls`, which a scene has as
                `scene.walls.fixed_position`; `box`, its `scene.space.box`.
        """
        from .plotting import snapshot_figure

        number = -1 if time is None else self.nearest(time)
        return snapshot_figure(float(self.time[number]), self.snapshot(number), **options)

    def animate(self, path: str | os.PathLike, **options: Any) -> Path:
        """A moving picture of all snapshots; returns its path.

        Args:
            path: of the picture, ending with `.gif` or `.mp4`; one that is there is replaced.
            options: of `jaxsph.plotting.animate`, as `field` and `every`; `walls` and
                `box` as for `plot`; `shapes` of free bodies,
                `jaxsph.io.BodyShapes.of(scene.walls)`.

        Raises:
            ValueError: as `jaxsph.plotting.animate`.
        """
        from .plotting.animation import draw_animation

        return draw_animation(self._one_by_one, path, **options)

    def save(self, path: str | os.PathLike, overwrite: bool = False) -> Path:
        """Write a trajectory file, which `jaxsph.io.read_trajectory` reads; returns its path.

        No run can go on from it, as it does not know what made the run; `run_scene(scene, path)`
        writes one that does.

        Args:
            path: of the file; folders are made as needed.
            overwrite: whether an existing file may be replaced.

        Raises:
            ValueError: if times do not increase.
            TrajectoryFileError: if the file exists, or cannot be written.
        """
        from .io import save_trajectory

        return save_trajectory(self, path, overwrite)

    def to_xarray(self) -> Any:
        """An `xarray.Dataset` over time, particle and direction, units among its attributes.

        Raises:
            ImportError: if xarray is not installed.
        """
        from .io.dataset import dataset

        return dataset(self)

    def to_pyvista(self, time: float | None = None) -> Any:
        """The particles of the snapshot nearest to a time as a `pyvista.PolyData`, in SI units.

        Point data are `velocity`, `density` and `pressure`, field data `time`; vectors in two
        dimensions get a third component of zero. `jaxsph.io.write_vtkhdf` writes all times.

        Args:
            time: [s]; the end if none is given.

        Raises:
            ImportError: if PyVista is not installed.
        """
        from .io.point_cloud import point_cloud

        number = -1 if time is None else self.nearest(time)
        return point_cloud(float(self.time[number]), self.snapshot(number))

    def _one_by_one(self, every: int) -> Iterator[Trajectory]:
        if every < 1:
            raise ValueError(f"every: every {every}-th snapshot; give at least 1.")
        numbers = range(0, len(self.time), every)
        return (jax.tree.map(lambda field: field[k : k + 1], self) for k in numbers)  # noqa: B023

    def _rows(self) -> dict[str, str] | None:
        if not concrete(self.time, self.velocity, self.density):
            return None
        name = self.metadata.get("scene")
        there = ... if self.active is None else np.asarray(self.active)
        speed = np.linalg.norm(self.velocity, axis=-1)[there]
        return {
            **({} if name is None else {"scene": str(name)}),
            "snapshots": f"{len(self.time)}, at {spread(self.time, 's')}",
            "particles": f"{self.particles} in {self.position.shape[-1]}D",
            "speed": spread(speed, "m/s"),
            "density": spread(np.asarray(self.density)[there], "kg/m^3"),
            "pressure": spread(np.asarray(self.pressure)[there], "Pa"),
            **({"forces on": ", ".join(self.forces)} if self.forces else {}),
            **({} if self.coordinates is None else {"modes": str(self.coordinates.shape[-1])}),
        }

    def __repr__(self):
        return line(self, self._rows())

    def _repr_html_(self):
        return table(self, self._rows())
