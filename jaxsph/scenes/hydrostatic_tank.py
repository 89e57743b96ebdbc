"""The hydrostatic tank: water at rest under gravity."""

from __future__ import annotations

import jax.numpy as jnp

from ..arrangements import Arrangement
from ..domain import Box
from ..effects import Gravity
from ..kernels import Kernel
from ..schemes import Consistent, Scheme
from ..walls import BoxRegion
from .composed import pick_scale, positive
from .enclosed import enclosed_flow
from .scales import Scale
from .scene import Scene

REFERENCE_DENSITY = 1000.0  # kg/m^3
GRAVITY = 1.0  # m/s^2, so that sqrt(g H) = 1 m/s
SCALES = {
    "small": Scale(resolution=50, h_over_dx=2.0, time_step=2.5e-3, steps_per_snapshot=40),
    "half": Scale(resolution=100, h_over_dx=2.0, time_step=1.25e-3, steps_per_snapshot=80),
    "paper": Scale(resolution=200, h_over_dx=2.0, time_step=6.25e-4, steps_per_snapshot=160),
}


def hydrostatic_pressure(position):
    """p = rho0 g (H - y) [Pa], H = 1 m."""
    return REFERENCE_DENSITY * GRAVITY * (1.0 - position[:, 1])


def still_water(position, time):
    """Velocity (N, 2) [m/s], zero, and pressure (N,) [Pa] at positions (N, 2) [m], at any time."""
    return jnp.zeros_like(position), hydrostatic_pressure(position)


def hydrostatic_tank(
    resolution: int | None = None,
    reynolds: float = 100.0,
    *,
    scale: str = "small",
    h_over_dx: float | None = None,
    time_step: float | None = None,
    end_time: float = 10.0,
    layers: int | None = None,
    arrangement: Arrangement | None = None,
    kernel: Kernel | None = None,
    scheme: Scheme | None = None,
    mach: float = 0.1,
    dtype=None,
) -> Scene:
    """Water at rest under gravity in a tank of 1 m x 1 m, closed by walls all round.

    rho0 = 1000 kg/m^3, g = 1 m/s^2, U = sqrt(g H) = 1 m/s, Re = U H / nu; it starts with the
    hydrostatic pressure p = rho0 g (H - y) and should keep it.

    Args:
        resolution: particles per side; overrides the scale's, time step scaled along.
        reynolds: Reynolds number.
        scale: `small` (50 x 50), `half` (100 x 100) or `paper` (200 x 200).
        h_over_dx: smoothing length over spacing; overrides the scale's.
        time_step: dt [s]; overrides the scale's.
        end_time: [s].
        layers: of ghosts; a full support's if none is given.
        arrangement: how particles start; the lattice if none is given.
        kernel: Wendland C2 if none is given.
        scheme: of `jaxsph.schemes`; `Consistent()` if none is given.
        mach: Mach number U / c0.
        dtype: float64 or float32; JAX's default if none is given.

    Raises:
        ValueError: for a Reynolds number, resolution or step out of range.
    """
    positive(reynolds=reynolds, **{"t-end": end_time})
    chosen = pick_scale(SCALES, scale).with_overrides(end_time, resolution, h_over_dx, time_step)
    return enclosed_flow(
        "hydrostatic-tank",
        box=Box((0.0, 0.0), (1.0, 1.0), (False, False)),
        fluid_region=BoxRegion((0.0, 0.0), (1.0, 1.0)),
        force=Gravity(jnp.asarray([0.0, -GRAVITY])),
        scale=chosen,
        end_time=end_time,
        reference_density=REFERENCE_DENSITY,
        reference_speed=1.0,
        mach=mach,
        viscosity=1.0 / reynolds,
        pressure=hydrostatic_pressure,
        layers=layers,
        arrangement=arrangement,
        kernel=kernel,
        scheme=Consistent() if scheme is None else scheme,
        dtype=dtype,
        solution=still_water,
        parameters={"scale": scale, "reynolds": reynolds},
    )
