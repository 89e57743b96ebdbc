"""The Gresho vortex: a steady eddy without viscosity."""

from __future__ import annotations

import jax.numpy as jnp

from ..arrangements import Arrangement
from ..domain import Box
from ..kernels import Kernel
from ..record import record
from ..schemes import Consistent, Scheme
from .composed import composed, pick_scale, positive
from .scales import Scale
from .scene import Scene

REFERENCE_DENSITY = 1000.0  # kg/m^3
SCALES = {
    "small": Scale(resolution=64, h_over_dx=2.0, time_step=2.5e-3, steps_per_snapshot=10),
    "half": Scale(resolution=128, h_over_dx=2.0, time_step=1.25e-3, steps_per_snapshot=20),
    "paper": Scale(resolution=256, h_over_dx=2.0, time_step=6.25e-4, steps_per_snapshot=40),
}


def gresho_velocity(position):
    """u_phi = 5 r for r <= 0.2 m, 2 - 5 r up to 0.4 m, 0 beyond, around (0.5, 0.5) m, as (N, 2)."""
    offset = position - 0.5
    r = _radius(offset)
    turn = jnp.where(r <= 0.2, 5.0, jnp.maximum(2.0 / r - 5.0, 0.0))
    return jnp.stack([-turn * offset[:, 1], turn * offset[:, 0]], axis=1)


def gresho_pressure(position):
    """The pressure [Pa] that holds this eddy together, dp/dr = rho0 u_phi^2 / r, zero outside."""
    r = _radius(position - 0.5)
    core = 12.5 * r**2
    ring = 4.0 * jnp.log(r / 0.2) + 4.0 - 20.0 * r + 12.5 * r**2
    rim = 4.0 * jnp.log(2.0) - 2.0
    p = jnp.where(r <= 0.2, core, jnp.where(r <= 0.4, ring, rim)) - rim
    return REFERENCE_DENSITY * p


def gresho_flow(position, time):
    """Velocity (N, 2) [m/s] and pressure (N,) [Pa]; the eddy is steady."""
    return gresho_velocity(position), gresho_pressure(position)


def gresho_vortex(
    resolution: int | None = None,
    *,
    scale: str = "small",
    h_over_dx: float | None = None,
    time_step: float | None = None,
    end_time: float = 1.0,
    arrangement: Arrangement | None = None,
    kernel: Kernel | None = None,
    scheme: Scheme | None = None,
    mach: float = 0.1,
    dtype=None,
) -> Scene:
    """The Gresho vortex on the periodic unit square (Gresho and Chan 1990): steady, inviscid.

    rho0 = 1000 kg/m^3, peak speed U = 1 m/s at r = 0.2 m. What it loses it loses to the scheme:
    the scene lists no viscosity.

    Args:
        resolution: particles per side; overrides the scale's, time step scaled along.
        scale: `small` (64 x 64), `half` (128 x 128) or `paper` (256 x 256).
        h_over_dx: smoothing length over spacing; overrides the scale's.
        time_step: dt [s]; overrides the scale's.
        end_time: [s].
        arrangement: how particles start; packed if none is given.
        kernel: Wendland C2 if none is given.
        scheme: of `jaxsph.schemes`; `Consistent()` if none is given.
        mach: Mach number U / c0.
        dtype: float64 or float32; JAX's default if none is given.

    Raises:
        ValueError: for a resolution or step out of range.
    """
    positive(**{"t-end": end_time})
    scheme = Consistent() if scheme is None else scheme
    return composed(
        "gresho-vortex",
        effects=scheme.effects(),
        box=Box.unit_periodic(2),
        scale=pick_scale(SCALES, scale).with_overrides(end_time, resolution, h_over_dx, time_step),
        end_time=end_time,
        reference_density=REFERENCE_DENSITY,
        reference_speed=1.0,
        mach=mach,
        velocity=gresho_velocity,
        pressure=gresho_pressure,
        arrangement=arrangement,
        kernel=kernel,
        dtype=dtype,
        solution=gresho_flow,
        parameters={"scale": scale, "scheme": record(scheme)},
    )


def _radius(offset):
    """Distance from the centre [m], a little off zero there so that it may divide."""
    return jnp.sqrt(jnp.sum(offset * offset, axis=1) + 1e-20)
