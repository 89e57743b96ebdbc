"""What all flows between walls share: ghosts, and a start from rest on a lattice."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from ..arrangements import Arrangement, Lattice
from ..domain import Box
from ..effects import BodyForce, Effect
from ..kernels import Kernel
from ..record import record
from ..schemes import Consistent, Scheme
from ..walls import MovingWall, Region, WallPart, Walls
from .composed import composed, positive
from .scales import Scale
from .scene import Scene
from .solution import ExactFlow


def enclosed_flow(
    name: str,
    *,
    box: Box,
    fluid_region: Region,
    scale: Scale,
    end_time: float,
    reference_density: float,
    reference_speed: float,
    mach: float = 0.1,
    viscosity: float,
    scheme: Scheme | None = None,
    side: float | None = None,
    moving: Sequence[MovingWall] = (),
    parts: Sequence[WallPart] = (),
    opening: Region | None = None,
    in_rows: Sequence[Region] = (),
    force: BodyForce | None = None,
    wall_velocity: Effect | None = None,
    pressure: Callable | None = None,
    layers: int | None = None,
    arrangement: Arrangement | None = None,
    kernel: Kernel | None = None,
    dtype=None,
    solution: ExactFlow | None = None,
    parameters: dict[str, Any] | None = None,
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
        scheme: of `jaxsph.schemes`; `Consistent()` if none is given.
        side: the length [m] that the resolution divides; the box's longest if none is given.
        moving: parts of the walls that slide along themselves.
        parts: of the walls, whose forces are recorded by name.
        opening: where the fluid may reach past the box's faces.
        in_rows: parts of the walls whose ghosts are in rows along them.
        force: body force, if there is one.
        wall_velocity: how viscosity sees the walls; the scheme's own no-slip if none is given.
        pressure: positions (N, n) [m] -> pressure at the start (N,) [Pa]; zero if none is given.
        layers: of ghosts; as many as fill the kernel's support if none is given.
        arrangement: how particles start; the lattice if none is given.
        kernel: Wendland C2 if none is given.
        dtype: float64 or float32; JAX's default if none is given.
        solution: the exact flow, if it is known; as of `Scene`.
        parameters: what the scene was made with, for the record; what all share is added.

    Raises:
        ValueError: for a value out of range, a bad geometry, or a time step beyond its limit.
    """
    positive(viscosity=viscosity)
    scheme = Consistent() if scheme is None else scheme

    return composed(
        name,
        effects=scheme.effects(viscosity, force, fluid_region, wall_velocity),
        box=box,
        scale=scale,
        end_time=end_time,
        reference_density=reference_density,
        reference_speed=reference_speed,
        mach=mach,
        side=side,
        region=fluid_region,
        walls=lambda space: Walls.around(
            fluid_region, space, moving, layers, parts=parts, opening=opening, in_rows=in_rows
        ),
        pressure=pressure,
        arrangement=Lattice() if arrangement is None else arrangement,
        kernel=kernel,
        dtype=dtype,
        solution=solution,
        parameters={**(parameters or {}), "layers": layers, "scheme": record(scheme)},
    )
