"""What all flows between walls share: delta-plus-SPH with ghosts, from rest on a lattice."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp

from ..arrangements import Arrangement, Lattice
from ..domain import Box
from ..effects import (
    BodyForce,
    Continuity,
    DensityDiffusion,
    Effect,
    LaminarViscosity,
    NoSlip,
    ParticleShifting,
    PressureForce,
    ShiftingTransport,
    WallPressure,
    WallRepulsion,
)
from ..fluid import Fluid
from ..kernels import Kernel, WendlandC2
from ..pairs import Space
from ..particles import ParticleState
from ..walls import MovingWall, Region, Walls
from ..walls.walls import fill
from .scales import Scale
from .scene import Scene, as_dtype

DELTA = 0.1  # of the density diffusion


def enclosed_flow(
    name: str,
    *,
    box: Box,
    fluid_region: Region,
    scale: Scale,
    end_time: float,
    reference_density: float,
    reference_speed: float,
    mach: float,
    viscosity: float,
    side: float | None = None,
    moving: Sequence[MovingWall] = (),
    force: Callable[[Any], BodyForce] | None = None,
    wall_velocity: Effect | None = None,
    pressure: Callable | None = None,
    layers: int | None = None,
    arrangement: Arrangement | None = None,
    kernel: Kernel | None = None,
    dtype=None,
    parameters: dict[str, Any],
) -> Scene:
    """A flow between walls, at rest at the start.

    Args:
        name: of the scene.
        box: around the fluid; its closed directions end at walls.
        fluid_region: where fluid may be.
        scale: resolution, h/dx and steps.
        end_time: [s].
        reference_density: rho0 [kg/m^3].
        reference_speed: U [m/s].
        mach: U / c0.
        viscosity: nu [m^2/s].
        side: the length [m] that the resolution divides; the box's longest if none is given.
        moving: parts of the walls that slide along themselves.
        force: makes the body force in a given dtype, if there is one.
        wall_velocity: how viscosity sees the walls; `NoSlip()` if none is given.
        pressure: positions (N, n) [m] -> pressure at the start (N,) [Pa]; zero if none is given.
        layers: of ghosts; as many as fill the kernel's support if none is given.
        arrangement: how particles start; the lattice if none is given.
        kernel: Wendland C2 if none is given.
        dtype: float64 or float32; JAX's default if none is given.
        parameters: what the scene was made with, for the record; what all share is added.

    Raises:
        ValueError: for a value out of range, a bad geometry, or a time step beyond its limit.
    """
    positive(viscosity=viscosity, mach=mach, **{"t-end": end_time})
    kernel = WendlandC2() if kernel is None else kernel
    arrangement = Lattice() if arrangement is None else arrangement
    dtype = jnp.zeros(()).dtype if dtype is None else jnp.dtype(dtype)
    dx = (max(box.lengths) if side is None else side) / scale.resolution
    space = Space(box, kernel, scale.h_over_dx * dx, dx)
    space.check()
    fluid = Fluid(*(
        jnp.asarray(v, dtype) for v in (reference_density, reference_speed / mach, reference_speed)
    ))  # fmt: skip
    drive = None if force is None else force(dtype)
    walls = Walls.around(fluid_region, space, moving, layers)
    position = fill(fluid_region, Lattice().positions(space), arrangement.positions(space))
    start = jnp.zeros(position.shape[0]) if pressure is None else pressure(position)
    density = reference_density + start * (mach / reference_speed) ** 2
    return Scene(
        name=name,
        effects=(
            Continuity(),
            PressureForce(),
            LaminarViscosity(jnp.asarray(viscosity, dtype)),
            DensityDiffusion(jnp.asarray(DELTA, dtype)),
            ParticleShifting(),
            ShiftingTransport(),
            *(() if drive is None else (drive,)),
            WallPressure(drive),
            NoSlip() if wall_velocity is None else wall_velocity,
            WallRepulsion(fluid_region),
        ),
        fluid=fluid,
        space=space,
        state=as_dtype(ParticleState(position, jnp.zeros_like(position), density), dtype),
        time_step=scale.time_step,
        end_time=end_time,
        steps_per_snapshot=scale.steps_per_snapshot,
        parameters={
            **parameters,
            "resolution": scale.resolution,
            "h_over_dx": scale.h_over_dx,
            "time_step": scale.time_step,
            "end_time": end_time,
            "mach": mach,
            "layers": layers,
            "arrangement": arrangement.record(),
            "kernel": type(kernel).__name__,
            "dtype": str(dtype),
        },
        walls=jax.tree.map(lambda a: a.astype(dtype), walls),
    )


def pick_scale(scales: dict[str, Scale], scale: str) -> Scale:
    """A scale by its name.

    Raises:
        ValueError: if there is no such scale.
    """
    if scale not in scales:
        raise ValueError(f"scale: one of {', '.join(scales)}, got {scale!r}.")
    return scales[scale]


def positive(**values: float) -> None:
    """Raise a ValueError that names the first value that is not positive."""
    for name, value in values.items():
        if not value > 0.0:
            raise ValueError(f"{name}: must be positive, got {value:g}.")
