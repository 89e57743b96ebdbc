"""What a scene is."""

from __future__ import annotations

import dataclasses
from typing import Any

import equinox as eqx
import numpy as np

from ..effects import Effect, parking_of
from ..fluid import Fluid
from ..full_model import CFL, FullModel
from ..functional import SPHFunctional
from ..neighbors import CAPACITY_MARGIN, NeighborSearch, WalledSearch
from ..pairs import Space
from ..parking import Parking, flowing
from ..particles import ParticleState, in_dtype
from ..schedule import Schedule
from ..shown import concrete, line, table
from ..walls import Walls
from ..walls.filling import refuse_rows_at_walls, volume
from .checks import check_filled, check_one_fluid, check_resolved
from .solution import ExactFlow, Solution

_SKIN = 0.82  # times dx: rebuilt about every second step of the paper's settings (measured)
_WALL_MARGIN = 1.3  # times the list's need at the start: particles begin on a lattice there
_SKIN_PER_STEP = 3.5  # times the way of the fastest particle in a step, at least


class Scene(eqx.Module):
    """A domain, particles, a fluid and a tuple of effects, with the steps to run it by.

    All its real numbers are taken into the precision of its particles' positions.

    Args:
        name: as users type it.
        effects: what acts on the particles.
        fluid: the fluid.
        space: box, kernel, smoothing length, spacing.
        state: the particles at time 0.
        time_step: dt [s].
        end_time: of the run [s].
        steps_per_snapshot: between recorded snapshots.
        parameters: what the scene was made with, JSON-like, for the record.
        walls: around the fluid, if it has any.
        solution: the exact flow, if it is known: positions (N, n) [m] and a time [s] -> velocity
            (N, n) [m/s] and pressure (N,) [Pa]; read it as `exact`.

    Raises:
        ValueError: if the time step is beyond the stability limit or does not divide the end time,
            a particle starts inside a wall or a row of them at one, the fluid leaves a part of its
            room empty without a free surface, densities are not those of one fluid, or positions
            are so far from the origin that their precision is too coarse for the spacing.
    """

    name: str = eqx.field(static=True)
    effects: tuple[Effect, ...]
    fluid: Fluid
    space: Space = eqx.field(static=True)
    state: ParticleState
    time_step: float = eqx.field(static=True)
    end_time: float = eqx.field(static=True)
    steps_per_snapshot: int = eqx.field(static=True)
    parameters: dict[str, Any] = eqx.field(static=True, default_factory=dict)
    walls: Walls | None = None
    # what is known of a run does not make it another run: `content` leaves it out
    solution: ExactFlow | Solution | None = eqx.field(static=True, default=None, compare=False)

    def __post_init__(self):
        dtype = self.state.position.dtype
        free = None if self.walls is None else self.walls.free
        if free is not None and self.state.bodies is None:
            self.state = dataclasses.replace(self.state, bodies=free.state)
        for name in ("effects", "fluid", "state", "walls"):
            setattr(self, name, in_dtype(getattr(self, name), dtype))
        self.time_step, self.end_time = float(self.time_step), float(self.end_time)
        if self.solution is not None and not isinstance(self.solution, Solution):
            self.solution = Solution.of(self, self.solution)

    def __check_init__(self):
        inside = flowing(self.state.position, self.parking)
        if self.walls is not None:
            beyond = np.asarray(self.walls.beyond(self.state.position))
            if self.parking is not None:
                beyond = beyond & ~np.asarray(self.parking.holds(self.state.position))
            if beyond.any():
                first = int(np.argmax(beyond))
                raise ValueError(
                    f"particles: number {first} at {np.asarray(self.state.position[first])} m and "
                    f"{int(beyond.sum()) - 1} more start inside a wall; leave them out or move "
                    "the wall."
                )
            refuse_rows_at_walls(self.walls, inside, self.space)
        check_one_fluid(self.state.density, float(self.fluid.reference_density))
        check_resolved(self.state.position, self.space)
        check_filled(len(inside), self.space, self._room)
        limit = self.stable_time_step
        if not 0.0 < self.time_step <= limit * (1.0 + 1e-12):
            raise ValueError(
                f"time step: {self.time_step:g} s is beyond the stability limit of {limit:.4g} s "
                "(the least of 1.5 h/c0, 0.125 h^2/nu, that of particles which start close to a "
                "wall, and the limits of other effects; the first is shorter where a free body is "
                "light); choose one below it."
            )
        schedule = self.schedule
        if abs(schedule.end_time - self.end_time) > 1e-6 * self.end_time:
            interval = self.steps_per_snapshot
            raise ValueError(
                f"time step: {interval} steps of {self.time_step:g} s (from snapshot to snapshot) "
                f"do not divide the end time of {self.end_time:g} s; the nearest step that does "
                f"is {self.end_time / schedule.steps:.6g} s."
            )

    @property
    def exact(self) -> ExactFlow | None:
        """The exact flow; None where it is not known, or no longer holds: another effect, fluid,
        box, wall or start than the scene was given it for. Where an edit leaves the flow as it is,
        say so by `dataclasses.replace(scene, effects=..., solution=scene.exact)`.

        Examples:
            >>> import dataclasses
            >>> import jaxsph
            >>> from jaxsph.arrangements import Lattice
            >>> scene = jaxsph.scenes.taylor_green(16, arrangement=Lattice())
            >>> velocity, pressure = scene.exact(scene.state.position, 0.5)
            >>> pressure.shape
            (256,)
            >>> dataclasses.replace(scene, effects=scene.effects[:2]).exact is None
            True
        """
        holds = self.solution is not None and self.solution.holds(self)
        return self.solution.flow if holds else None

    @property
    def stable_time_step(self) -> float:
        """The largest stable step [s]: acoustic CFL of the paper, less where a free body is light,
        and those of its effects."""
        acoustic = CFL * self.space.smoothing_length / float(self.fluid.sound_speed)
        if self.walls is not None and self.walls.free is not None:
            acoustic *= float(self.walls.free.step_share(self.fluid.reference_density))
        of_all = self.fluid, self.space
        limits = [float(effect.step_limit(*of_all)) for effect in self.effects]
        start = [effect.step_limit_from(self.state.position, *of_all) for effect in self.effects]
        return min(acoustic, *limits, *start)

    @property
    def schedule(self) -> Schedule:
        """The steps of the run."""
        return Schedule.until(self.end_time, self.time_step, self.steps_per_snapshot)

    @property
    def steps(self) -> int:
        """Number of them."""
        return self.schedule.steps

    @property
    def mass(self):
        """Mass of a particle [kg]: rho0 V / N where the fluid fills a volume V, its vessel or its
        periodic box, and rho0 times a cell of the lattice where it has a free surface or
        openings."""
        return self.fluid.reference_density * self.particle_volume

    @property
    def particle_volume(self) -> float:
        """Volume of a particle at rest [m^n]."""
        room = self._room
        if room is None or self.parking is not None:  # how many are in the flow changes
            return self.space.cell_volume
        return room / len(self.state.position)

    @property
    def parking(self) -> Parking | None:
        """Where particles wait that are in no flow; None where none come in or go out."""
        return parking_of(self.effects)

    @property
    def _room(self) -> float | None:
        """Volume [m^n] that the fluid fills; None where it may have a free surface."""
        if any(effect.frees_surface for effect in self.effects):
            return None
        if self.walls is not None:
            return volume(self.walls.start_region, self.space)
        return self.space.box.volume if all(self.space.box.periodic) else None

    def _rows(self) -> dict[str, str] | None:
        if not concrete(self.state.position):
            return None
        walls = "none" if self.walls is None else f"{len(self.walls.position)} ghosts"
        count = len(self.state.position)
        parked = count - len(flowing(self.state.position, self.parking))
        return {
            "name": self.name,
            "particles": f"{count} in {self.space.box.dim}D"
            + (f", {parked} of them parked" if parked else ""),
            "spacing": f"{self.space.spacing:.4g} m",
            "h/dx": f"{self.space.smoothing_length / self.space.spacing:.4g}",
            "walls": walls,
            "effects": ", ".join(effect.name for effect in self.effects),
            "steps": f"{self.steps} of {self.time_step:.4g} s",
            "end time": f"{self.end_time:.4g} s",
        }

    def __repr__(self):
        return line(self, self._rows())

    def _repr_html_(self):
        return table(self, self._rows())

    def functional(self) -> SPHFunctional:
        """The scene's effects composed into f(w, t; mu)."""
        return SPHFunctional(self.effects, self.fluid, self.mass, self.space, self.walls)

    def search(
        self, state: ParticleState | None = None, margin: float | None = None
    ) -> NeighborSearch | WalledSearch:
        """Neighbour search allocated for a state (the initial one if none is given).

        Its lists have `margin` times the room that the state needs, or what a scene without or
        with walls is known to need.

        Raises:
            ValueError: if the box is too small for the kernel's support.
        """
        state = self.state if state is None else state
        motion = float(self.fluid.reference_speed) * self.time_step
        skin = max(_SKIN * self.space.spacing, _SKIN_PER_STEP * motion)
        box, support = self.space.box, self.space.support
        if self.walls is None:
            margin = CAPACITY_MARGIN if margin is None else margin
            return NeighborSearch.allocate(
                state.position, box, support, skin, margin, self.parking
            )
        return WalledSearch.allocate(
            state.position,
            self.walls.position,
            box,
            support,
            skin,
            self.space.spacing,
            _WALL_MARGIN if margin is None else margin,
            moving=self.walls.bodies is not None,
            parking=self.parking,
        )

    def model(self, state: ParticleState | None = None, margin: float | None = None) -> FullModel:
        """The full model, its neighbour list allocated for a state."""
        return FullModel(self.functional(), self.search(state, margin))
