"""The dam break: a column of water collapses, runs along the floor and hits the wall."""

from __future__ import annotations

import jax.numpy as jnp

from ..arrangements import Arrangement, Lattice
from ..domain import Box
from ..effects import ArtificialViscosity, Effect, Gravity, NoSlip
from ..kernels import Kernel
from ..record import record
from ..schemes import Consistent, Scheme
from ..walls import BoxRegion, Walls
from .composed import composed, pick_scale, positive
from .scales import Scale
from .scene import Scene

REFERENCE_DENSITY = 1000.0  # kg/m^3
GRAVITY = 9.81  # m/s^2
WIDTH = 0.05715  # m, a of Martin and Moyce (1952): 2 1/4 inches
SCALES = {
    "small": Scale(resolution=150, h_over_dx=2.0, time_step=1.2e-4, steps_per_snapshot=30),
    "half": Scale(resolution=300, h_over_dx=2.0, time_step=6e-5, steps_per_snapshot=60),
    "paper": Scale(resolution=600, h_over_dx=2.0, time_step=3e-5, steps_per_snapshot=120),
}


def dam_break(
    resolution: int | None = None,
    *,
    column: tuple[float, float] = (WIDTH, 2.0 * WIDTH),
    tank: tuple[float, float] = (5.0 * WIDTH, 3.0 * WIDTH),
    alpha: float = 0.02,
    scale: str = "small",
    h_over_dx: float | None = None,
    time_step: float | None = None,
    end_time: float = 0.36,
    arrangement: Arrangement | None = None,
    kernel: Kernel | None = None,
    mach: float = 0.1,
    scheme: Scheme | None = None,
    wall_velocity: Effect | None = None,
    dtype=None,
) -> Scene:
    """A column of water in the corner of a closed tank, let go at t = 0.

    rho0 = 1000 kg/m^3, g = 9.81 m/s^2; the start is hydrostatic.
    U = 3 (g H)^(1/2) with H the column's height: where jets meet, they compress the water by their
    speed over c0. The column and its tank are by default those of
    Martin and Moyce (1952), a = 0.05715 m wide and twice as high, in a tank 5 a long.

    Args:
        resolution: particles along the tank; overrides the scale's, time step scaled along.
        column: width and height of the water at the start [m].
        tank: inner length and height [m].
        alpha: strength of the artificial viscosity.
        scale: `small` (150), `half` (300) or `paper` (600 particles along it).
        h_over_dx: smoothing length over spacing; overrides the scale's.
        time_step: dt [s]; overrides the scale's.
        end_time: [s].
        arrangement: how particles start; the lattice if none is given.
        kernel: Wendland C2 if none is given.
        mach: Mach number U / c0.
        scheme: of `jaxsph.schemes`; `Consistent()` if none is given.
        wall_velocity: how viscosity sees the walls; `NoSlip()` if none is given, which holds up a
            tongue of a few particles' thickness; `FreeSlip()` does not.
        dtype: float64 or float32; JAX's default if none is given.

    Raises:
        ValueError: for a column that does not fit its tank, a resolution or a step out of range.
    """
    scheme = Consistent() if scheme is None else scheme
    column, tank = (tuple(map(float, pair)) for pair in (column, tank))
    positive(alpha=alpha, column=min(column), **{"t-end": end_time})
    if column[0] >= tank[0] or column[1] >= tank[1]:
        raise ValueError(
            f"column: {column[0]:g} m x {column[1]:g} m must fit the tank of {tank[0]:g} m x "
            f"{tank[1]:g} m and leave it room to fall."
        )
    wall_velocity = NoSlip() if wall_velocity is None else wall_velocity
    vessel, height = BoxRegion((0.0, 0.0), tank), column[1]

    effects = scheme.free_surface_effects(
        ArtificialViscosity(jnp.asarray(alpha, float)),
        force=Gravity(jnp.asarray([0.0, -GRAVITY])),
        vessel=vessel,
        wall_velocity=wall_velocity,
    )

    return composed(
        "dam-break",
        effects=effects,
        box=Box((0.0, 0.0), tank, (False, False)),
        scale=pick_scale(SCALES, scale).with_overrides(end_time, resolution, h_over_dx, time_step),
        end_time=end_time,
        reference_density=REFERENCE_DENSITY,
        reference_speed=3.0 * (GRAVITY * height) ** 0.5,
        mach=mach,
        side=tank[0],
        region=BoxRegion((0.0, 0.0), column),
        walls=lambda space: Walls.around(vessel, space),
        pressure=lambda x: REFERENCE_DENSITY * GRAVITY * (height - x[:, 1]),
        arrangement=Lattice() if arrangement is None else arrangement,
        kernel=kernel,
        dtype=dtype,
        parameters={
            "scale": scale,
            "scheme": record(scheme),
            "column": column,
            "tank": tank,
            "alpha": alpha,
            "wall_velocity": record(wall_velocity),
        },
    )
