"""The full model: the SPH functional with its neighbour list, in the protocol of the time loop."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from .effects import Effect
from .functional import SPHFunctional
from .integrate import Fault, FaultCode, Model
from .integrate.one_or_many import renewed_if
from .likely_cause import likely_cause, squeezed_water
from .neighbors import NeighborSearch, VerletList, WalledSearch, WallList
from .parking import Parking
from .particles import ParticleState
from .trajectory import Snapshot
from .walls import Walls
from .walls.rotation import within_half_a_turn

DENSITY_BOUNDS = (0.8, 1.2)  # times rho0; weakly compressible flow stays within about one percent
CFL = 1.5  # dt <= CFL h / c0 (paper)
FORCE_SHARE = 0.25  # dt <= 0.25 (h / a)^1/2 (Monaghan 1992)
SKIN_SHARE = 0.4  # of the neighbour list's skin in a step; half of it is a fault, and shifting adds
SHIFT_SHARE = 0.5  # of the reference speed: the limit of the shift velocity


class FullModel(Model):
    """dw/dt = f(w, t; mu) on moving particles.

    Args:
        functional: the right-hand side.
        search: capacities of its neighbour list.
    """

    functional: SPHFunctional
    search: NeighborSearch | WalledSearch

    @property
    def parking(self) -> Parking | None:
        """Where particles wait that are in no flow, if some come in or go out."""
        return self.search.parking

    def at(self, time):
        walls = self.functional.walls
        if walls is None or walls.bodies is None:
            return self
        return self._with(walls.at(time))

    def _with(self, walls: Walls) -> FullModel:
        functional = dataclasses.replace(self.functional, walls=walls)
        return dataclasses.replace(
            self, functional=functional, search=self.search.moved(walls.position)
        )

    def _beside(self, state: ParticleState) -> FullModel:
        """The same with its free bodies where a state has them; itself where there are none."""
        walls = self.functional.walls
        if walls is None or walls.free is None:
            return self
        bodies = dataclasses.replace(walls.bodies, free=walls.free.at(state.bodies))
        return self._with(walls.moved(bodies))

    def prepare(self, state: ParticleState) -> VerletList | WallList:
        return self._beside(state).search.build(state.position)

    def refresh(self, auxiliary, state, time_step):
        search, motion = self._motion(state, time_step)
        return refresh_list(search, auxiliary, state.position, motion)

    def _motion(self, state, time_step):
        """The search where its ghosts are, and how far [m] a particle may move in a step."""
        speed = self._largest_speed(state)
        speed = speed + SHIFT_SHARE * self.functional.fluid.reference_speed
        search = self._beside(state).search
        return search, speed * time_step

    def begin(self, state):
        if self.search.devices is None and self.parking is None:
            return state, self._outdated(state)
        return self._listed(state, self._beside(state).search)

    def _listed(self, state, search):
        """A state as steps keep it, and its list made anew."""
        neighbors = search.build(state.position)
        if search.devices is None:
            return state, neighbors
        return _arranged(state, neighbors.sort), neighbors.in_place()

    def _outdated(self, state):
        """A list that the first step makes anew: programs that step hold its making once."""
        like = jax.eval_shape(self.prepare, state)
        empty = jax.tree.map(lambda leaf: jnp.zeros(leaf.shape, leaf.dtype), like)
        away = 0.5 * np.asarray(self.search.box.lengths)  # farther than any particle may go
        away = lax.stop_gradient(state.position) + away.astype(state.position.dtype)[None]
        return eqx.tree_at(lambda neighbors: neighbors.reference, empty, away)

    def keep_up(self, state, auxiliary, time_step):
        if self.search.devices is None and self.parking is None:
            return state, self.refresh(auxiliary, state, time_step)
        search, motion = self._motion(state, time_step)

        def rebuilt(carry):
            state, neighbors = carry
            if self.parking is not None:  # who is put in is by number, on however many devices
                state = self.end(state, neighbors)
                return self._listed(state, search)
            new = search.build(state.position)
            return _arranged(state, new.sort), new.in_place(neighbors.order)

        outdated = is_outdated(search, auxiliary, state.position, motion)
        return renewed_if(outdated, rebuilt, (state, auxiliary))

    def end(self, state, auxiliary):
        since = auxiliary.reference
        if self.search.devices is not None:
            state = _arranged(state, auxiliary.by_number)
            since = auxiliary.by_number(since) if self.parking is not None else since
        for effect in self.functional.effects:  # what came in and went out since
            state = effect.exchanged(state, since, self.functional.fluid)
        return state

    def rates(self, time, state, auxiliary):
        return self.functional(time, state, auxiliary)

    def finish(self, state):
        box = self.functional.space.box
        state = eqx.tree_at(lambda s: s.position, state, box.wrap(state.position))
        if state.bodies is None:
            return state
        return eqx.tree_at(lambda s: s.bodies.angle, state, within_half_a_turn(state.bodies.angle))

    def inspect(self, step, state, auxiliary):
        here = self._beside(state)
        walls = here.functional.walls
        return Fault.first_of(
            step,
            *body_checks(walls),
            *wall_checks(walls, state.position, auxiliary.first, self.parking),
            *here._opening_checks(state, auxiliary),
            *field_checks(state, here.functional.fluid.reference_density, auxiliary.first),
            *list_checks(here.search, auxiliary, state.position),
        )

    def _opening_checks(self, state, neighbors):
        """The check that particles enough are parked for those that come in."""
        if self.parking is None:
            return ()
        effects, where = self.functional.effects, (state.position, neighbors.reference)
        return tuple((FaultCode.NONE_PARKED, e.exhausted(*where), -1) for e in effects)

    def step_limit(self, state, change):
        """The least of 1.5 h / (c0 + |u|) s, 0.25 (h / |a|)^1/2, 0.4 b / |u| and the limits of the
        effects, with the largest speed of a particle or a body, the largest acceleration of a
        particle or a free body and the neighbour list's skin b; the paper's 1.5 h / c0 at rest. s
        is 1, or `FreeBodies.step_share` where there are free bodies."""
        functional = self.functional
        fluid, space = functional.fluid, functional.space
        speed = self._largest_speed(state)
        limit = CFL * space.smoothing_length / (fluid.sound_speed + speed)
        if functional.walls is not None and functional.walls.free is not None:
            limit = limit * functional.walls.free.step_share(fluid.reference_density)
        moving = speed > 0.0
        outrun = SKIN_SHARE * self.search.skin / jnp.where(moving, speed, 1.0)
        limit = jnp.where(moving, jnp.minimum(limit, outrun), limit)
        forced = change > 0.0
        force = FORCE_SHARE * jnp.sqrt(space.smoothing_length / jnp.where(forced, change, 1.0))
        limit = jnp.where(forced, jnp.minimum(limit, force), limit)
        for effect in functional.effects:
            limit = jnp.minimum(limit, effect.step_limit(fluid, space))
        return lax.stop_gradient(limit)

    def _largest_speed(self, state):
        """Of a particle, or of a body that is moved."""
        speed = jnp.sqrt(jnp.max(jnp.sum(state.velocity**2, axis=1)))
        walls = self._beside(state).functional.walls
        if walls is None or walls.bodies is None:
            return speed
        return jnp.maximum(speed, walls.bodies.speed)

    def largest_change(self, old, new):
        change = jnp.max(jnp.sum((new.velocity - old.velocity) ** 2, axis=1))
        if old.bodies is not None:
            of_bodies = jnp.sum((new.bodies.velocity - old.bodies.velocity) ** 2, axis=1)
            change = jnp.maximum(change, jnp.max(of_bodies))
        return jnp.sqrt(change)

    def with_effect(self, effect: Effect):
        """The same with other coefficients of one effect; see `SPHFunctional.with_effect`."""
        return dataclasses.replace(self, functional=self.functional.with_effect(effect))

    def likely_cause(self, fault, state, time_step):
        here = self.at(jnp.asarray(int(fault.step) * time_step, state.position.dtype))
        limit = float(here.step_limit(state, jnp.zeros((), state.position.dtype)))
        of = here._beside(state).functional
        particle = int(fault.particle)
        if self.parking is not None and bool(self.parking.holds(state.position)[particle]):
            return None  # it has gone out meanwhile
        squeezed = squeezed_water(of.walls, of.space)
        if squeezed is not None:
            return squeezed
        return likely_cause(state, particle, of.space, of.fluid, of.walls, time_step, limit)

    def over(self, devices):
        devices.warn_of_kept_programs()
        return dataclasses.replace(self, search=self.search.over(devices))

    def enlarged(self):
        return dataclasses.replace(self, search=self.search.enlarged())

    def observe(self, state):
        return Snapshot(
            position=state.position,
            velocity=state.velocity,
            density=state.density,
            pressure=self.functional.fluid.pressure(state.density),
            bodies=state.bodies,
            active=None if self.parking is None else ~self.parking.holds(state.position),
        )


def refresh_list(search, neighbors: VerletList | WallList, position, motion):
    """The list, rebuilt if particles that move on by up to `motion` [m] would outrun its skin."""
    outdated = is_outdated(search, neighbors, position, motion)
    return renewed_if(outdated, lambda _: search.build(position), neighbors)


def is_outdated(search, neighbors: VerletList | WallList, position, motion):
    """Whether particles that move on by up to `motion` [m] would outrun the list's skin."""
    moved = search.largest_motion(neighbors, position)[0]
    return ~(moved + lax.stop_gradient(motion) <= 0.5 * search.skin)  # nor where that is NaN


def _arranged(state: ParticleState, order: Callable) -> ParticleState:
    """A state with its particles in another order."""
    particles = jax.tree.map(order, dataclasses.replace(state, bodies=None))
    return dataclasses.replace(particles, bodies=state.bodies)


def list_checks(search, neighbors: VerletList | WallList, position):
    """Checks that no neighbour was missed: capacities, and motion within the skin."""
    moved, particle = search.largest_motion(neighbors, position)
    return (
        (FaultCode.NEIGHBOR_OVERFLOW, neighbors.overflow, -1),
        (FaultCode.NEIGHBORS_OUTDATED, moved > 0.5 * search.skin, particle),
    )


def body_checks(walls: Walls | None):
    """The checks that free bodies are finite, and in no wall nor in one another."""
    free = None if walls is None else walls.free
    if free is None:
        return ()
    free = lax.stop_gradient(free)
    lost = [~jnp.all(jnp.isfinite(leaf)) for leaf in jax.tree.leaves(free.state)]
    places = free.surface(*lax.stop_gradient((walls.position, walls.normal)))
    met = []
    for number in range(len(free.parts)):
        apart = -walls.signed_distance_without(number, places)
        met.append(jnp.any((free.owner == number) & (apart < 0.0)))
    return (
        *((FaultCode.NOT_FINITE, each, -1) for each in lost),
        *((FaultCode.BODY_MET_WALL, each, -1) for each in met),
    )


def wall_checks(
    walls: Walls | None, position, first: Callable = jnp.argmax, parking: Parking | None = None
):
    """The check that no particle has gone through a wall, where there are walls; `first` is the
    number of the first particle of those marked."""
    if walls is None:
        return ()
    beyond = walls.beyond(lax.stop_gradient(position))
    if parking is not None:
        beyond = beyond & ~parking.holds(position)
    return ((FaultCode.BEYOND_WALL, jnp.any(beyond), first(beyond)),)


def field_checks(state: ParticleState, reference_density, first: Callable = jnp.argmax):
    """Checks that all is finite and every density within its bounds, `first` as for walls."""
    total = state.density + jnp.sum(state.velocity, axis=1) + jnp.sum(state.position, axis=1)
    wild = ~jnp.isfinite(total)
    ratio = state.density / reference_density
    out = (ratio < DENSITY_BOUNDS[0]) | (ratio > DENSITY_BOUNDS[1])
    return (
        (FaultCode.NOT_FINITE, jnp.any(wild), first(wild)),
        (FaultCode.DENSITY_OUT_OF_BOUNDS, jnp.any(out), first(out)),
    )
