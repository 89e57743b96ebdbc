"""The doubly periodic shear layers of Brown and Minion."""

from __future__ import annotations

import jax.numpy as jnp

from ..arrangements import Arrangement
from ..domain import Box
from ..effects import BackgroundPressure, LaminarViscosity
from ..kernels import Kernel
from .composed import composed, pick_scale, positive
from .delta_plus import delta_plus
from .scales import Scale
from .scene import Scene

SCALES = {
    "small": Scale(resolution=64, h_over_dx=2.0, time_step=2.5e-3, steps_per_snapshot=10),
    "half": Scale(resolution=128, h_over_dx=2.0, time_step=1.25e-3, steps_per_snapshot=20),
    "paper": Scale(resolution=256, h_over_dx=2.0, time_step=6.25e-4, steps_per_snapshot=40),
}
KICK = 0.05  # m/s, the cross flow that sets the layers rolling
REFERENCE_DENSITY = 1000.0  # kg/m^3
BACKGROUND_PRESSURE = 4.0 * REFERENCE_DENSITY  # Pa, with U = 1 m/s


def shear_layer(
    resolution: int | None = None,
    reynolds: float = 10_000.0,
    *,
    thickness: float = 1.0 / 30.0,
    scale: str = "small",
    h_over_dx: float | None = None,
    time_step: float | None = None,
    end_time: float = 1.0,
    arrangement: Arrangement | None = None,
    kernel: Kernel | None = None,
    mach: float = 0.1,
    dtype=None,
) -> Scene:
    """Two shear layers on the periodic unit square that roll up (Brown and Minion 1995):

        u = tanh((y - 1/4) / d) for y <= 1/2, tanh((3/4 - y) / d) above,    v = 0.05 sin(2 pi x).

    Re = U L / nu, U = 1 m/s, L = 1 m, rho0 = 1000 kg/m^3. With d = 1/30 m each layer rolls into
    one vortex; with d = 1/80 m schemes without enough resolution make up more of them.

    A background pressure of 4 rho0 U^2 keeps the vortices' cores, whose pressure sinks by up to
    4 rho0 U^2, from negative pressure, where particles would clump.

    Args:
        resolution: particles per side; overrides the scale's, time step scaled along.
        reynolds: Reynolds number.
        thickness: d [m].
        scale: `small` (64 x 64), `half` (128 x 128) or `paper` (256 x 256).
        h_over_dx: smoothing length over spacing; overrides the scale's.
        time_step: dt [s]; overrides the scale's.
        end_time: [s].
        arrangement: how particles start; packed if none is given.
        kernel: Wendland C2 if none is given.
        mach: Mach number U / c0.
        dtype: float64 or float32; JAX's default if none is given.

    Raises:
        ValueError: for a Reynolds number, thickness, resolution or step out of range.
    """
    positive(reynolds=reynolds, thickness=thickness, **{"t-end": end_time})

    def velocity(position):
        x, y = position[:, 0], position[:, 1]
        along = jnp.where(
            y <= 0.5, jnp.tanh((y - 0.25) / thickness), jnp.tanh((0.75 - y) / thickness)
        )
        return jnp.stack([along, KICK * jnp.sin(2.0 * jnp.pi * x)], axis=1)

    return composed(
        "shear-layer",
        effects=lambda dtype: (
            *delta_plus(dtype, LaminarViscosity(jnp.asarray(1.0 / reynolds, dtype))),
            BackgroundPressure(jnp.asarray(BACKGROUND_PRESSURE, dtype)),
        ),
        box=Box.unit_periodic(2),
        scale=pick_scale(SCALES, scale).with_overrides(end_time, resolution, h_over_dx, time_step),
        end_time=end_time,
        reference_density=REFERENCE_DENSITY,
        reference_speed=1.0,
        mach=mach,
        velocity=velocity,
        arrangement=arrangement,
        kernel=kernel,
        dtype=dtype,
        parameters={"scale": scale, "reynolds": reynolds, "thickness": thickness},
    )
