"""What open channels share: an inflow with a parabolic profile, an outflow, walls between."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from ..arrangements import Arrangement
from ..domain import Box
from ..effects import Fringe, ParabolicProfile
from ..kernels import Kernel
from ..schemes import Scheme
from ..walls import BoxRegion, Region, WallPart
from .enclosed import enclosed_flow
from .scales import Scale
from .scene import Scene
from .solution import ExactFlow

_RATE = 0.3  # of a fringe, times h / c0: half of what the longest step stands


def open_channel(
    name: str,
    *,
    length: float,
    fringe: float,
    height: float,
    mean_speed: float,
    inflow: eqx.Module | None = None,
    start: Callable | None = None,
    obstacle: Region | None = None,
    parts: Sequence[WallPart] = (),
    solution: ExactFlow | None = None,
    scale: Scale,
    end_time: float,
    viscosity: float,
    mach: float,
    layers: int | None,
    arrangement: Arrangement | None,
    kernel: Kernel | None,
    scheme: Scheme | None,
    dtype: Any,
    parameters: dict[str, Any],
) -> Scene:
    """A channel from x = 0 to `length` [m], flowed through; its box goes on by a `Fringe`.

    Args:
        name: of the scene.
        length: of the channel [m].
        fringe: least length of the fringe [m]; it ends where a row of particles does.
        height: of the channel [m].
        mean_speed: of the inflow's parabola [m/s]; its peak, half as much again, is the speed that
            the Mach number is of: no inflow should be much faster.
        inflow: its profile, positions (N, 2) [m] and a time [s] -> velocities (N, 2) [m/s], if it
            is another than that parabola: `Varying(ParabolicProfile(...), factor)`, say.
        start: positions (N, 2) [m] -> velocities at the start (N, 2) [m/s]; the inflow's profile
            everywhere if none is given.
        obstacle: in the channel, if there is one.
        parts: of the walls, whose forces are recorded by name.
        solution: the exact flow, if it is known.
        scale, end_time, viscosity, mach, layers, arrangement, kernel, scheme, dtype, parameters: as
            those of `enclosed_flow`.

    Raises:
        ValueError: as `enclosed_flow`.
    """
    spacing = height / scale.resolution
    whole = spacing * math.ceil((length + fringe) / spacing - 1e-9)
    region: Region = BoxRegion((-np.inf, 0.0), (np.inf, height))
    region = region if obstacle is None else region & ~obstacle
    parabola = ParabolicProfile(jnp.asarray(1.5 * mean_speed), height)
    profile = parabola if inflow is None else inflow
    rate = jnp.asarray(_RATE * 1.5 * mean_speed / (mach * scale.h_over_dx * spacing))
    scene = enclosed_flow(
        name,
        box=Box((0.0, 0.0), (whole, height), (True, False)),
        fluid_region=region,
        scale=scale,
        end_time=end_time,
        reference_density=1.0,
        reference_speed=1.5 * mean_speed,
        mach=mach,
        viscosity=viscosity,
        scheme=scheme,
        side=height,
        parts=parts,
        layers=layers,
        arrangement=arrangement,
        kernel=kernel,
        dtype=dtype,
        parameters=parameters,
    )
    state = scene.state
    began = jnp.zeros((), state.position.dtype)
    flowing = profile(state.position, began) if start is None else start(state.position)
    return dataclasses.replace(
        scene,
        effects=(*scene.effects, Fringe(profile, rate, length, whole)),
        state=dataclasses.replace(state, velocity=flowing),
        solution=solution,
    )
