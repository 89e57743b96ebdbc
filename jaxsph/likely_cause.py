"""What a fault of the full model most likely comes from, told by the last good particles."""

from __future__ import annotations

import numpy as np

from .fluid import Fluid
from .pairs import Space
from .particles import ParticleState
from .walls import Walls

_NEAR = 0.25  # times dx: half of where a particle rests beside a wall
_BESIDE = 1.0  # times dx: of a wall that makes a corner with another
_CLUMPED = 0.5  # times dx
_SQUEEZED = 3.0  # times dx: so near to a wall two rows are left between it and a free body
_FAST = 0.3  # of the sound speed: the density changes by the square of it
_TENSION = 0.01  # of rho0 below it
_BEYOND = 1.25  # times the step limit, which a flow that is being lost exceeds a little anyway


def squeezed_water(walls: Walls | None, space: Space) -> str | None:
    """That a free body is about to touch something, and what to do; None if none is. On the host.

    Args:
        walls: where they are, if there are any.
        space: kernel and spacing.
    """
    free = None if walls is None else walls.free
    if free is None:
        return None
    places, owner = free.surface(walls.position, walls.normal), np.asarray(free.owner)
    for number in range(len(free.parts)):
        own = np.asarray(places)[owner == number]
        gap = -float(np.max(walls.signed_distance_without(number, own))) / space.spacing
        if gap < _SQUEEZED:
            return (
                f"likely contact, which is not modelled: free body {number} is {gap:.2g} spacings "
                "from a wall or another body, and the water between them is pressed out; end the "
                "run before, or leave more room around the body"
            )
    return None


def likely_cause(
    state: ParticleState,
    particle: int,
    space: Space,
    fluid: Fluid,
    walls: Walls | None,
    time_step: float,
    limit: float,
) -> str | None:
    """What is likely and what to do, in one line; None if nothing stands out. On the host.

    Args:
        state: the last good one.
        particle: at which the fault shows; -1 if at none.
        space: box, kernel and spacing.
        fluid: density and sound speed.
        walls: where they are then, if there are any.
        time_step: dt [s].
        limit: the longest stable step [s] from that state.
    """
    if time_step > _BEYOND * limit:
        return (
            f"likely the step: {time_step:.3g} s is beyond {limit:.3g} s, the limit at the speeds "
            "reached; use a smaller time step, automatic steps or a higher sound speed"
        )
    if particle < 0:
        return None
    dx, sound = space.spacing, float(fluid.sound_speed)
    position, velocity = np.asarray(state.position), np.asarray(state.velocity)
    here = position[particle]
    at = f"particle {particle} at ({', '.join(f'{x:.4g}' for x in here)}) m"
    speed = float(np.linalg.norm(velocity[particle]))
    if speed > _FAST * sound:
        return (
            f"likely a flow too fast for its sound: {at} has {speed:.3g} m/s, {speed / sound:.0%} "
            "of the sound speed; raise that to ten times the largest speed"
        )
    if walls is not None:
        depth = -float(walls.signed_distance(here[None])[0]) / dx
        beside = _walls_beside(walls, here, dx)
        if len(beside) > 1:
            return (
                f"likely a corner: {at} has walls across {' and '.join(beside)} within a spacing, "
                f"the nearest at {depth:.2g}; use the consistent scheme if the fluid fills its "
                "vessel, a higher viscosity or another resolution"
            )
        if depth < _NEAR:
            return (
                f"likely a wall near a row: {at} is {depth:.2g} spacings from a wall; let walls "
                "lie between rows of particles at the start, or raise the resolution"
            )
    apart = _nearest(position, particle, space) / dx
    if apart < _CLUMPED:
        return (
            f"likely clumping: {at} has its next neighbour {apart:.2g} spacings away; list "
            "ParticleShifting, TensileControl or BackgroundPressure, or widen h/dx"
        )
    ratio = float(state.density[particle]) / float(fluid.reference_density)
    if ratio < 1.0 - _TENSION:
        return (
            f"likely tension: {at} has {ratio:.3g} times the reference density, a negative "
            "pressure; list BackgroundPressure, TensileControl or a FreeSurface"
        )
    return None


def _walls_beside(walls: Walls, here, spacing: float) -> list[str]:
    """The axes along which a wall is within a spacing."""
    moves = _BESIDE * spacing * np.eye(len(here), dtype=here.dtype)
    beyond = np.asarray(walls.beyond(np.concatenate([here + moves, here - moves])))
    either = beyond.reshape(2, -1).any(axis=0)
    return [name for name, near in zip("xyz", either, strict=False) if near]


def _nearest(position, particle: int, space: Space) -> float:
    """Distance [m] to the nearest other particle."""
    apart = np.asarray(space.box.displacement(position[particle][None], position))
    distance = np.linalg.norm(apart, axis=1)
    distance[particle] = np.inf
    return float(distance.min())
