"""A dam break in three dimensions that meets a box on the floor."""

from __future__ import annotations

import jax.numpy as jnp

from ..arrangements import Arrangement, Lattice
from ..domain import Box
from ..effects import ArtificialViscosity, Effect, FreeSlip, Gravity
from ..kernels import Kernel
from ..record import record
from ..schemes import Consistent, Scheme
from ..walls import BoxRegion, WallPart, Walls
from .composed import composed, pick_scale, positive
from .scales import Scale
from .scene import Scene

REFERENCE_DENSITY = 1000.0  # kg/m^3
GRAVITY = 9.81  # m/s^2
TANK = (3.22, 1.0, 1.0)  # m: length, breadth, height
COLUMN = (1.228, 1.0, 0.55)  # m, at the far end of it
OBSTACLE = BoxRegion((0.6635, 0.2985, -0.5), (0.8245, 0.7015, 0.161))  # m
GAUGES = {  # m, in the middle of the tank
    "H1": (0.496, 0.5),
    "H2": (0.992, 0.5),
    "H3": (1.488, 0.5),
    "H4": (2.638, 0.5),
}
SCALES = {
    "small": Scale(resolution=110, h_over_dx=1.3, time_step=6.25e-4, steps_per_snapshot=32),
    "half": Scale(resolution=165, h_over_dx=1.3, time_step=4e-4, steps_per_snapshot=50),
    "paper": Scale(resolution=220, h_over_dx=1.3, time_step=3.125e-4, steps_per_snapshot=64),
}


def dam_break_3d(
    resolution: int | None = None,
    *,
    alpha: float = 0.02,
    scale: str = "small",
    h_over_dx: float | None = None,
    time_step: float | None = None,
    end_time: float = 1.2,
    arrangement: Arrangement | None = None,
    kernel: Kernel | None = None,
    mach: float = 0.1,
    scheme: Scheme | None = None,
    wall_velocity: Effect | None = None,
    dtype=None,
) -> Scene:
    """A column of water let go in a tank with a box on its floor: the experiment of Kleefsman,
    Fekken, Veldman, Iwanowski and Buchner (2005), test case 2 of SPHERIC.

    The tank is 3.22 m long, 1 m wide and 1 m high; water 0.55 m deep fills its last 1.228 m; the
    box, 0.161 m x 0.403 m x 0.161 m, begins 0.6635 m from the other end. The third axis points up.
    `GAUGES` are the places of the experiment's wave gauges, for `jaxsph.metrics.surface_height`;
    the force on the wall's part `box` is recorded. rho0 = 1000 kg/m^3, g = 9.81 m/s^2, the start is
    hydrostatic, U = 3 (g H)^(1/2) with H the column's height, as in `dam_break`. The tank has a lid
    here.

    Args:
        resolution: particles along the tank; overrides the scale's, time step scaled along. The
            box takes 104 or more, times h/dx over 1.3.
        alpha: strength of the artificial viscosity.
        scale: `small` (110), `half` (165) or `paper` (220 particles along it).
        h_over_dx: smoothing length over spacing; overrides the scale's.
        time_step: dt [s]; overrides the scale's.
        end_time: [s].
        arrangement: how particles start; the lattice if none is given.
        kernel: Wendland C2 if none is given.
        mach: Mach number U / c0.
        scheme: of `jaxsph.schemes`; `Consistent()` if none is given.
        wall_velocity: how viscosity sees the walls; `FreeSlip()` if none is given, the boundary
            layer of water being far thinner than a spacing.
        dtype: float64 or float32; JAX's default if none is given.

    Raises:
        ValueError: for a resolution that the box is too thin for, or a step out of range.
    """
    scheme = Consistent() if scheme is None else scheme
    wall_velocity = FreeSlip() if wall_velocity is None else wall_velocity
    positive(alpha=alpha, **{"t-end": end_time})
    front, height = TANK[0] - COLUMN[0], COLUMN[2]
    vessel = BoxRegion((0.0, 0.0, 0.0), TANK) & ~OBSTACLE
    effects = scheme.free_surface_effects(
        ArtificialViscosity(jnp.asarray(alpha, float)),
        force=Gravity(jnp.asarray([0.0, 0.0, -GRAVITY])),
        vessel=vessel,
        wall_velocity=wall_velocity,
    )
    return composed(
        "dam-break-3d",
        effects=effects,
        box=Box((0.0, 0.0, 0.0), TANK, (False, False, False)),
        scale=pick_scale(SCALES, scale).with_overrides(end_time, resolution, h_over_dx, time_step),
        end_time=end_time,
        reference_density=REFERENCE_DENSITY,
        reference_speed=3.0 * (GRAVITY * height) ** 0.5,
        mach=mach,
        side=TANK[0],
        region=BoxRegion((front, 0.0, 0.0), (TANK[0], TANK[1], height)),
        walls=lambda space: Walls.around(
            vessel, space, parts=[WallPart("box", OBSTACLE, reference_length=0.161)]
        ),
        pressure=lambda x: REFERENCE_DENSITY * GRAVITY * (height - x[:, 2]),
        arrangement=Lattice() if arrangement is None else arrangement,
        kernel=kernel,
        dtype=dtype,
        parameters={
            "scale": scale,
            "scheme": record(scheme),
            "alpha": alpha,
            "wall_velocity": record(wall_velocity),
        },
    )
