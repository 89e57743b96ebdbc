"""A scene composed from a box, a rule for its particles, and a tuple of effects."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import jax.numpy as jnp
from jaxtyping import Array

from ..arrangements import Arrangement, Packed
from ..domain import Box
from ..effects import Effect
from ..fluid import Fluid
from ..kernels import Kernel, WendlandC2
from ..pairs import Space
from ..particles import ParticleState, in_dtype
from ..record import record
from ..walls import Region, Walls
from ..walls.walls import fill
from .fitting import fitted_resolution
from .scales import Scale
from .scene import Scene
from .solution import ExactFlow

GHOSTS = ("rows", "lattice")  # how those of a curved wall may stand
_CLEAR = 0.2  # times dx: between particles and walls at the start, outside of `WallRepulsion`


def composed(
    name: str,
    *,
    effects: tuple[Effect, ...],
    box: Box,
    scale: Scale,
    end_time: float,
    reference_density: float,
    reference_speed: float,
    mach: float = 0.1,
    sound_speed: float | None = None,
    side: float | None = None,
    region: Region | None = None,
    walls: Callable[[Space], Walls] | None = None,
    velocity: Callable[[Array], Array] | None = None,
    pressure: Callable[[Array], Array] | None = None,
    arrangement: Arrangement | None = None,
    kernel: Kernel | None = None,
    dtype=None,
    solution: ExactFlow | None = None,
    parameters: dict[str, Any] | None = None,
) -> Scene:
    """What every scene of this library does with its settings.

    Args:
        name: of the scene.
        effects: what acts on the particles.
        box: around all that may happen.
        scale: resolution, h/dx and steps.
        end_time: [s].
        reference_density: rho0 [kg/m^3].
        reference_speed: U [m/s].
        mach: U / c0.
        sound_speed: c0 [m/s], where it is not U / mach.
        side: the length [m] that the resolution divides, after it is fitted to the region's flat
            faces; the box's longest if none is given.
        region: where fluid is at the start; if none is given all that walls leave, or the box.
        walls: makes the walls, if there are any.
        velocity: positions (N, n) [m] -> velocities at the start (N, n) [m/s]; rest if none is
            given.
        pressure: positions (N, n) [m] -> pressure at the start (N,) [Pa]; zero if none is given.
        arrangement: how particles start; packed if none is given.
        kernel: Wendland C2 if none is given.
        dtype: float64 or float32; JAX's default if none is given.
        solution: the exact flow, if it is known; as of `Scene`.
        parameters: what the scene was made with, for the record; what all share is added.

    Raises:
        ValueError: for a value out of range, a bad geometry, or a time step beyond its limit.
    """
    positive(mach=mach, **{"t-end": end_time})
    kernel = WendlandC2() if kernel is None else kernel
    arrangement = Packed() if arrangement is None else arrangement
    dtype = jnp.zeros(()).dtype if dtype is None else jnp.dtype(dtype)
    side = max(box.lengths) if side is None else side
    resolution = scale.resolution
    if region is not None:
        resolution = fitted_resolution(box, region, side, resolution)
    dx = side / resolution
    space = Space(box, kernel, scale.h_over_dx * dx, dx)
    space.check()
    fluid = Fluid(
        *(
            jnp.asarray(v, dtype)
            for v in (reference_density, sound_speed or reference_speed / mach, reference_speed)
        ),
    )
    around = None if walls is None else walls(space)
    region = around.start_region if region is None and around is not None else region
    position = arrangement.positions(space)
    if region is not None:
        position = fill(region, arrangement.places(space), position)
    if around is not None:
        # a particle that was moved into a wall is refused by the scene, not cured
        clear = around.put_inside(position, _CLEAR * space.spacing)
        position = jnp.where(around.beyond(position)[:, None], position, clear)
    moving = jnp.zeros_like(position) if velocity is None else velocity(position)
    start = jnp.zeros(len(position)) if pressure is None else pressure(position)
    density = fluid.density(jnp.asarray(start, dtype))
    return Scene(
        name=name,
        effects=effects,
        fluid=fluid,
        space=space,
        state=in_dtype(ParticleState(position, moving, density), dtype),
        time_step=scale.time_step,
        end_time=end_time,
        steps_per_snapshot=scale.steps_per_snapshot,
        parameters={
            **(parameters or {}),
            "resolution": scale.resolution,
            "h_over_dx": scale.h_over_dx,
            "time_step": scale.time_step,
            "end_time": end_time,
            "mach": mach,
            "arrangement": arrangement.record(),
            "kernel": record(kernel),
            "dtype": str(dtype),
        },
        walls=around,
        solution=solution,
    )


def in_rows(ghosts: str, parts: Sequence[Region]) -> tuple[Region, ...]:
    """Parts of the walls whose ghosts are in rows along them, as a scene's `ghosts` says."""
    if ghosts not in GHOSTS:
        raise ValueError(f"ghosts: one of {', '.join(GHOSTS)}, got {ghosts!r}.")
    return tuple(parts) if ghosts == "rows" else ()


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
