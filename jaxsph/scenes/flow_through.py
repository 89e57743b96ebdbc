"""What flows through a box share: an inflow and an outflow."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import partial
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from ..kernels import Kernel, WendlandC2
from ..shown import concrete
from ..walls import Region
from .enclosed import enclosed_flow
from .ends import Ends
from .scales import Scale
from .scene import Scene
from .solution import ExactFlow

_FASTER = 1.5  # times the speed that the sound's is of


def flow_through(
    name: str,
    *,
    length: float,
    ends: Ends,
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
    kernel: Kernel | None = None,
    **flow: Any,
) -> Scene:
    """Flow from x = 0 to `length` [m], with `Ends` beyond.

    Args:
        name: of the scene.
        length: from the inflow to the outflow [m].
        ends: of the flow: `FringeEnds(length)` or `OpenEnds()`.
        across: least and greatest y [m].
        periodic: whether the flow goes on across them; else there must be walls.
        region: where fluid may be.
        side: the length [m] that the resolution divides.
        speed: the fastest of the inflow [m/s], which the Mach number is of.
        inflow: its profile, positions (N, 2) [m] and a time [s] -> velocities (N, 2) [m/s].
        start: positions (N, 2) [m] -> velocities at the start (N, 2) [m/s]; the inflow's profile
            everywhere if none is given.
        solution: the exact flow, if it is known.
        scale, mach, kernel, flow: as those of `enclosed_flow`.

    Raises:
        ValueError: as `enclosed_flow`; for walls that change along the fringe's second half, where
            the inflow's velocity is held, and for an inflow that is no velocity or too fast.
    """
    kernel = WendlandC2() if kernel is None else kernel
    spacing = side / scale.resolution
    support = kernel.support * scale.h_over_dx * spacing
    box = ends.box(length, across, periodic, spacing, support)
    scene = enclosed_flow(
        name,
        box=box,
        fluid_region=region,
        scale=scale,
        reference_density=1.0,
        reference_speed=speed,
        mach=mach,
        side=side,
        kernel=kernel,
        opening=ends.opening(length),
        **flow,
    )
    state = scene.state
    began = jnp.zeros((), state.position.dtype)
    entering = inflow(state.position, began)
    _check_inflow(entering, state.position, partial(ends.held, length=length), speed)
    flowing = entering if start is None else start(state.position)
    scene = dataclasses.replace(scene, state=dataclasses.replace(state, velocity=flowing))
    closed = ends.close(scene, length, inflow, region)
    return dataclasses.replace(closed, solution=solution)


def _check_inflow(velocity, position, held: Callable, speed: float) -> None:
    """A ValueError if an inflow is no velocity, or too fast for the sound where it is held."""
    if jnp.shape(velocity) != position.shape:
        raise ValueError(
            f"inflow: gives an array of shape {jnp.shape(velocity)} for positions of shape "
            f"{position.shape}; return a velocity for each."
        )
    if not concrete(velocity, position):
        return
    there = held(np.asarray(position)[:, 0])
    fastest = float(np.linalg.norm(np.asarray(velocity)[there], axis=1).max(initial=0.0))
    if not fastest <= _FASTER * speed:
        raise ValueError(
            f"inflow: is as fast as {fastest:.4g} m/s at the start, and the speed of sound is set "
            f"by {speed:g} m/s; give its fastest as `speed`."
        )
