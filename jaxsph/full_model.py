"""The full model: the SPH functional with its neighbour list, in the protocol of the time loop."""

from __future__ import annotations

import dataclasses

import equinox as eqx
import jax.numpy as jnp
from jax import lax

from .functional import SPHFunctional
from .integrate import Fault, FaultCode, Model
from .neighbors import NeighborSearch, VerletList
from .particles import ParticleState
from .trajectory import Snapshot

DENSITY_BOUNDS = (0.8, 1.2)  # times rho0; weakly compressible flow stays within about one percent
SHIFT_SHARE = 0.5  # of the reference speed: the limit of the shift velocity


class FullModel(Model):
    """dw/dt = f(w, t; mu) on moving particles.

    Args:
        functional: the right-hand side.
        search: capacities of its neighbour list (static).
    """

    functional: SPHFunctional
    search: NeighborSearch = eqx.field(static=True)

    def prepare(self, state: ParticleState) -> VerletList:
        return self.search.build(state.position)

    def refresh(self, auxiliary, state, time_step):
        speed = jnp.sqrt(jnp.max(jnp.sum(state.velocity**2, axis=1)))
        speed = speed + SHIFT_SHARE * self.functional.fluid.reference_speed
        return refresh_list(self.search, auxiliary, state.position, speed * time_step)

    def rates(self, time, state, auxiliary):
        return self.functional(time, state, auxiliary)

    def finish(self, state):
        box = self.functional.space.box
        return eqx.tree_at(lambda s: s.position, state, box.wrap(state.position))

    def inspect(self, step, state, auxiliary):
        return Fault.first_of(
            step,
            *field_checks(state, self.functional.fluid.reference_density),
            *list_checks(self.search, auxiliary, state.position),
        )

    def enlarged(self):
        return dataclasses.replace(self, search=self.search.enlarged())

    def observe(self, state):
        return Snapshot(
            position=state.position,
            velocity=state.velocity,
            density=state.density,
            pressure=self.functional.fluid.pressure(state.density),
        )


def refresh_list(search, neighbors: VerletList, position, motion) -> VerletList:
    """The list, rebuilt if particles that move on by up to `motion` [m] would outrun its skin."""
    moved = neighbors.largest_motion(search.grid.box, position)[0]
    outdated = moved + lax.stop_gradient(motion) > 0.5 * search.skin
    return lax.cond(outdated, search.build, lambda _: neighbors, position)


def list_checks(search, neighbors: VerletList, position):
    """Checks that no neighbour was missed: capacities, and motion within the skin."""
    moved, particle = neighbors.largest_motion(search.grid.box, position)
    return (
        (FaultCode.NEIGHBOR_OVERFLOW, neighbors.overflow, -1),
        (FaultCode.NEIGHBORS_OUTDATED, moved > 0.5 * search.skin, particle),
    )


def field_checks(state: ParticleState, reference_density):
    """Checks that all is finite and every density within its bounds."""
    total = state.density + jnp.sum(state.velocity, axis=1) + jnp.sum(state.position, axis=1)
    wild = ~jnp.isfinite(total)
    ratio = state.density / reference_density
    out = (ratio < DENSITY_BOUNDS[0]) | (ratio > DENSITY_BOUNDS[1])
    return (
        (FaultCode.NOT_FINITE, jnp.any(wild), jnp.argmax(wild)),
        (FaultCode.DENSITY_OUT_OF_BOUNDS, jnp.any(out), jnp.argmax(out)),
    )
