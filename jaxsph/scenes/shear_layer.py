"""The doubly periodic shear layers of Brown and Minion."""

from __future__ import annotations

import math

import jax.numpy as jnp

from ..arrangements import Arrangement
from ..domain import Box
from ..effects import BackgroundPressure
from ..kernels import Kernel
from ..record import record
from ..schemes import Consistent, Scheme
from .composed import composed, pick_scale, positive
from .scales import Scale
from .scene import Scene

SCALES = {
    "small": Scale(resolution=64, h_over_dx=2.0, time_step=2.5e-3, steps_per_snapshot=10),
    "half": Scale(resolution=128, h_over_dx=2.0, time_step=1.25e-3, steps_per_snapshot=20),
    "paper": Scale(resolution=256, h_over_dx=2.0, time_step=6.25e-4, steps_per_snapshot=40),
}
KICK = 0.05  # m/s, the cross flow that sets the layers rolling


def shear_layer(
    resolution: int | None = None,
    reynolds: float = 10_000.0,
    *,
    thickness: float = 1.0 / 30.0,
    background_pressure: float = 0.0,
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
    """Two shear layers on the periodic unit square that roll up (Brown and Minion 1995):

        u = tanh((y - 1/4) / d) for y <= 1/2, tanh((3/4 - y) / d) above,    v = 0.05 sin(2 pi x).

    Re = U L / nu, U = 1 m/s, L = 1 m, rho0 = 1000 kg/m^3. With d = 1/30 m each layer rolls into
    one vortex; with d = 1/80 m schemes without enough resolution make up more of them.

    The pressure in the vortices' cores sinks by rho0 U^2 and more. Where the layers are thin and
    the viscosity small, particles clump there, unless a background pressure of 2 to 4 rho0 U^2
    evens them out. It takes kinetic energy from resolved layers, and is left out unless asked for.

    Args:
        resolution: particles per side; overrides the scale's, time step scaled along.
        reynolds: Reynolds number.
        thickness: d [m].
        background_pressure: p_b [Pa]; rho0 U^2 is 1000 Pa.
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
        ValueError: for a Reynolds number, thickness, background pressure, resolution or step out of
            range.
    """
    positive(reynolds=reynolds, thickness=thickness, **{"t-end": end_time})
    if not 0.0 <= background_pressure < math.inf:
        raise ValueError(
            f"background_pressure: must be zero or positive, got {background_pressure:g} Pa."
        )

    def velocity(position):
        x, y = position[:, 0], position[:, 1]
        along = jnp.where(
            y <= 0.5, jnp.tanh((y - 0.25) / thickness), jnp.tanh((0.75 - y) / thickness)
        )
        return jnp.stack([along, KICK * jnp.sin(2.0 * jnp.pi * x)], axis=1)

    scheme = Consistent() if scheme is None else scheme

    effects = scheme.effects(1.0 / reynolds)
    if background_pressure != 0.0:
        effects = (*effects, BackgroundPressure(jnp.asarray(background_pressure, float)))
    return composed(
        "shear-layer",
        effects=effects,
        box=Box.unit_periodic(2),
        scale=pick_scale(SCALES, scale).with_overrides(end_time, resolution, h_over_dx, time_step),
        end_time=end_time,
        reference_density=1000.0,
        reference_speed=1.0,
        mach=mach,
        velocity=velocity,
        arrangement=arrangement,
        kernel=kernel,
        dtype=dtype,
        parameters={
            "scale": scale,
            "reynolds": reynolds,
            "thickness": thickness,
            "background_pressure": background_pressure,
            "scheme": record(scheme),
        },
    )
