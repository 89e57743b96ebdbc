"""What open channels share: an inflow with a parabolic profile, an outflow, walls between."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from ..arrangements import Arrangement
from ..effects import ParabolicProfile
from ..kernels import Kernel
from ..schemes import Scheme
from ..walls import BoxRegion, Region, WallPart
from .ends import Ends
from .flow_through import flow_through
from .scales import Scale
from .scene import Scene
from .solution import ExactFlow


def open_channel(
    name: str,
    *,
    length: float,
    ends: Ends,
    height: float,
    mean_speed: float,
    inflow: eqx.Module | None = None,
    start: Callable | None = None,
    obstacle: Region | None = None,
    parts: Sequence[WallPart] = (),
    in_rows: Sequence[Region] = (),
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
    """A channel from x = 0 to `length` [m], flowed through, with `Ends` beyond.

    Args:
        name: of the scene.
        length: of the channel [m].
        ends: of the flow: `FringeEnds(length)` or `OpenEnds()`.
        height: of the channel [m].
        mean_speed: of the inflow's parabola [m/s]; its peak, half as much again, is the speed that
            the Mach number is of: no inflow should be much faster.
        inflow: its profile, positions (N, 2) [m] and a time [s] -> velocities (N, 2) [m/s], if it
            is another than that parabola: `Varying(ParabolicProfile(...), factor)`, say.
        start: positions (N, 2) [m] -> velocities at the start (N, 2) [m/s]; the inflow's profile
            everywhere if none is given.
        obstacle: in the channel, if there is one.
        parts: of the walls, whose forces are recorded by name.
        in_rows: those whose ghosts are in rows along them.
        solution: the exact flow, if it is known.
        scale, end_time, viscosity, mach, layers, arrangement, kernel, scheme, dtype, parameters: as
            those of `enclosed_flow`.

    Raises:
        ValueError: as `enclosed_flow`.
    """
    region: Region = BoxRegion((-np.inf, 0.0), (np.inf, height))
    parabola = ParabolicProfile(jnp.asarray(1.5 * mean_speed), height)
    return flow_through(
        name,
        length=length,
        ends=ends,
        across=(0.0, height),
        region=region if obstacle is None else region & ~obstacle,
        side=height,
        speed=1.5 * mean_speed,
        inflow=parabola if inflow is None else inflow,
        start=start,
        solution=solution,
        parts=parts,
        in_rows=in_rows,
        scale=scale,
        end_time=end_time,
        viscosity=viscosity,
        mach=mach,
        layers=layers,
        arrangement=arrangement,
        kernel=kernel,
        scheme=scheme,
        dtype=dtype,
        parameters=parameters,
    )
