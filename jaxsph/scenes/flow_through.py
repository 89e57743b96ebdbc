"""What flows through a box share: an inflow, an outflow, a fringe that makes one of the other."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from ..domain import Box
from ..effects import Fringe
from ..shown import concrete
from ..walls import Region
from .enclosed import enclosed_flow
from .scales import Scale
from .scene import Scene
from .solution import ExactFlow

_RATE = 0.3  # of a fringe, times h / c0: half of what the longest step stands
_FASTER = 1.5  # times the speed that the sound's is of


def flow_through(
    name: str,
    *,
    length: float,
    fringe: float,
    across: tuple[float, float],
    periodic: bool = False,
    region: Region,
    side: float,
    speed: float,
    inflow: eqx.Module,
    start: Callable | None = None,
    solution: ExactFlow | None = None,
    scale: Scale,
    mach: float,
    **flow: Any,
) -> Scene:
    """Flow from x = 0 to `length` [m]; the box goes on by a `Fringe`.

    Args:
        name: of the scene.
        length: from the inflow to the outflow [m].
        fringe: least length of the fringe [m]; it ends where a row of particles does.
        across: least and greatest y [m].
        periodic: whether the flow goes on across them; else there must be walls.
        region: where fluid may be.
        side: the length [m] that the resolution divides.
        speed: the fastest of the inflow [m/s], which the Mach number is of.
        inflow: its profile, positions (N, 2) [m] and a time [s] -> velocities (N, 2) [m/s].
        start: positions (N, 2) [m] -> velocities at the start (N, 2) [m/s]; the inflow's profile
            everywhere if none is given.
        solution: the exact flow, if it is known.
        scale, mach, flow: as those of `enclosed_flow`.

    Raises:
        ValueError: as `enclosed_flow`; for walls that change along the fringe's second half, where
            the inflow's velocity is held, and for an inflow that is no velocity or too fast.
    """
    spacing = side / scale.resolution
    whole = spacing * math.ceil((length + fringe) / spacing - 1e-9)
    rate = jnp.asarray(_RATE * speed / (mach * scale.h_over_dx * spacing))
    held = Fringe(inflow, rate, length, whole)
    _check_even(region, held, across, spacing)
    scene = enclosed_flow(
        name,
        box=Box((0.0, across[0]), (whole, across[1]), (True, periodic)),
        fluid_region=region,
        scale=scale,
        reference_density=1.0,
        reference_speed=speed,
        mach=mach,
        side=side,
        **flow,
    )
    state = scene.state
    began = jnp.zeros((), state.position.dtype)
    entering = inflow(state.position, began)
    _check_inflow(entering, state.position, held, speed)
    flowing = entering if start is None else start(state.position)
    return dataclasses.replace(
        scene,
        effects=(*scene.effects, held),
        state=dataclasses.replace(state, velocity=flowing),
        solution=solution,
    )


def _check_even(
    region: Region, fringe: Fringe, across: tuple[float, float], spacing: float
) -> None:
    """A ValueError if walls change along the second half of a fringe."""
    columns = max(1, int(0.5 * (fringe.end - fringe.start) / spacing))
    x = fringe.end - spacing * (0.5 + np.arange(columns)[::-1])
    y = np.arange(across[0] + 0.5 * spacing, across[1], spacing)
    places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=2)
    distance = np.asarray(region.signed_distance(jnp.asarray(places.reshape(-1, 2))))
    fluid = (distance < 0.0).reshape(places.shape[:2])
    changes = np.flatnonzero((fluid != fluid[-1]).any(axis=1))
    if len(changes):
        raise ValueError(
            f"region: its walls change along the fringe, at x = {x[changes[0]]:.4g} m, where the "
            f"velocity of the inflow is held; let bodies end before {fringe.start:g} m, and walls "
            f"go on straight to {fringe.end:g} m."
        )


def _check_inflow(velocity, position, fringe: Fringe, speed: float) -> None:
    """A ValueError if an inflow is no velocity, or too fast for the sound where it is held."""
    if jnp.shape(velocity) != position.shape:
        raise ValueError(
            f"inflow: gives an array of shape {jnp.shape(velocity)} for positions of shape "
            f"{position.shape}; return a velocity for each."
        )
    if not concrete(velocity, position):
        return
    there = np.asarray(position)[:, 0] > fringe.start
    fastest = float(np.linalg.norm(np.asarray(velocity)[there], axis=1).max(initial=0.0))
    if not fastest <= _FASTER * speed:
        raise ValueError(
            f"inflow: is as fast as {fastest:.4g} m/s at the start, and the speed of sound is set "
            f"by {speed:g} m/s; give its fastest as `speed`."
        )
