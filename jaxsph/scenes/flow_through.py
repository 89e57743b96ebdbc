"""What flows through a box share: an inflow, an outflow, a fringe that makes one of the other."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax.numpy as jnp

from ..domain import Box
from ..effects import Fringe
from ..walls import Region
from .enclosed import enclosed_flow
from .scales import Scale
from .scene import Scene
from .solution import ExactFlow

_RATE = 0.3  # of a fringe, times h / c0: half of what the longest step stands


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
        ValueError: as `enclosed_flow`.
    """
    spacing = side / scale.resolution
    whole = spacing * math.ceil((length + fringe) / spacing - 1e-9)
    rate = jnp.asarray(_RATE * speed / (mach * scale.h_over_dx * spacing))
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
    flowing = inflow(state.position, began) if start is None else start(state.position)
    return dataclasses.replace(
        scene,
        effects=(*scene.effects, Fringe(inflow, rate, length, whole)),
        state=dataclasses.replace(state, velocity=flowing),
        solution=solution,
    )
