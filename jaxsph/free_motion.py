"""How the fluid and the body forces move free bodies."""

from __future__ import annotations

import jax.numpy as jnp

from .body_state import BodyState
from .effects import Effect
from .neighbors import WallList
from .wall_loads import ghost_loads
from .wall_surface import Loads, WallSurface, torques
from .walls import Walls
from .walls.rotation import angle_rate, spin_rate


def body_rates(
    effects: tuple[Effect, ...], walls: Walls, passed: tuple, neighbors: WallList
) -> BodyState:
    """Rates of the state of all free bodies:

        M dv/dt = F + M b(x_c),    d(I w)/dt = T,    dx_c/dt = v,

    and of their angles as `jaxsph.walls.rotation` has them.

    Args:
        effects: of the scene.
        walls: where they are then.
        passed: what `SPHFunctional.passes` found.
        neighbors: the list by which it did.
    """
    context, free = passed[0], walls.free
    loads = body_loads(effects, walls, passed, neighbors)
    mass, inertia = (jnp.stack([getattr(b, name) for b in free.parts]) for name in _INERT)
    acceleration = loads.force / mass[:, None]
    for force in context.forces:
        acceleration = acceleration + force.acceleration(context.time, free.state.position)
    angle, spin = free.state.angle, free.state.spin
    spun = spin_rate(angle, spin, loads.torque, inertia)
    return BodyState(free.state.velocity, angle_rate(angle, spin), acceleration, spun)


_INERT = ("mass", "inertia")


def body_loads(
    effects: tuple[Effect, ...], walls: Walls, passed: tuple, neighbors: WallList
) -> Loads:
    """Force [N] of the fluid on each free body and torque about its centre of mass [N m]: what
    the body's ghosts and the repulsion of its surface do to the fluid, reversed."""
    context, fields = passed[:2]
    free, position = walls.free, fields["position"]
    numbers = jnp.arange(len(free.parts), dtype=free.owner.dtype)
    bodies = numbers[:, None] == free.owner[None]
    held = jnp.concatenate([jnp.ones_like(bodies[:1]), bodies])
    held = held[:, neighbors.wall.ghosts].astype(position.dtype)
    on_ghosts, shares = ghost_loads(effects, walls, passed, neighbors, held)
    force, torque = (held[1:] @ each for each in on_ghosts)
    torque = torque - torques(free.state.position, force)
    none = jnp.zeros_like(position[:0])
    for number, center in enumerate(free.state.position):
        arm = free.box.displacement(jnp.broadcast_to(center[None], position.shape), position)
        part = jnp.ones((1, 0), bool)
        seen = WallSurface(none, none, part, arm, shares[number + 1 : number + 2])
        found = [effect.on_walls(context, fields, seen) for effect in effects]
        for each in (each for each in found if each is not None):
            force = force.at[number].add(each.force[0])
            torque = torque.at[number].add(each.torque[0])
    return Loads(force, torque)
