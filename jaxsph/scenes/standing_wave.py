"""A standing gravity wave that viscosity damps."""

from __future__ import annotations

import math

import jax.numpy as jnp
from scipy.optimize import newton

from ..arrangements import Arrangement, Lattice
from ..domain import Box
from ..effects import Gravity, LaminarViscosity
from ..kernels import Kernel
from ..record import record
from ..schemes import Consistent, Scheme
from ..walls import BoxRegion, Walls
from .composed import composed, pick_scale, positive
from .scales import Scale
from .scene import Scene

REFERENCE_DENSITY = 1000.0  # kg/m^3
GRAVITY = 1.0  # m/s^2, so that sqrt(g H) = 1 m/s
DEPTH = 1.0  # m
WAVE_NUMBER = math.pi  # rad/m: a wave as long as the basin of 2 m
FREQUENCY = math.sqrt(GRAVITY * WAVE_NUMBER * math.tanh(WAVE_NUMBER * DEPTH))  # rad/s
SCALES = {
    "small": Scale(resolution=80, h_over_dx=2.0, time_step=5e-3, steps_per_snapshot=20),
    "half": Scale(resolution=160, h_over_dx=2.0, time_step=2.5e-3, steps_per_snapshot=40),
    "paper": Scale(resolution=320, h_over_dx=2.0, time_step=1.25e-3, steps_per_snapshot=80),
}


def damping(viscosity: float) -> tuple[float, float]:
    """Decay rate of the energy [1/s] and frequency [rad/s] of a small wave on viscous water:

        (sigma + 2 nu k^2)^2 + w^2 = 4 nu^2 k^4 (1 + sigma / (nu k^2))^(1/2)

    with amplitude exp(sigma t) (Lamb 1932, section 349, deep water; at k H = pi the floor changes
    w^2 by 0.4 percent, which is kept, and a floor without friction damps nothing). For small nu the
    energy decays at 4 nu k^2; at Re = 250 the surface's boundary layer makes it 11 percent slower.
    Newton's method.
    """
    rate, square = viscosity * WAVE_NUMBER**2, FREQUENCY**2

    def off(sigma):
        return (sigma + 2.0 * rate) ** 2 + square - 4.0 * rate**2 * (1.0 + sigma / rate) ** 0.5

    root = newton(off, complex(-2.0 * rate, FREQUENCY), tol=1e-14)
    return -2.0 * root.real, root.imag


def standing_wave(
    resolution: int | None = None,
    reynolds: float = 250.0,
    *,
    amplitude: float = 0.05,
    scale: str = "small",
    h_over_dx: float | None = None,
    time_step: float | None = None,
    end_time: float = 12.0,
    arrangement: Arrangement | None = None,
    kernel: Kernel | None = None,
    mach: float = 0.1,
    scheme: Scheme | None = None,
    dtype=None,
) -> Scene:
    """A standing wave in a basin 2 m long, periodic, and 1 m deep (Antuono et al. 2011).

    It starts level, with the velocity of the linear wave,

        u = -A w sin(k x) cosh(k y) / sinh(k H),    v = A w cos(k x) sinh(k y) / sinh(k H),

    w^2 = g k tanh(k H). rho0 = 1000 kg/m^3, g = 1 m/s^2, Re = H (g H)^(1/2) / nu; the floor has no
    friction.

    Args:
        resolution: particles along the basin; overrides the scale's, time step scaled along.
        reynolds: Reynolds number.
        amplitude: A [m].
        scale: `small` (80), `half` (160) or `paper` (320 particles along it).
        h_over_dx: smoothing length over spacing; overrides the scale's.
        time_step: dt [s]; overrides the scale's.
        end_time: [s].
        arrangement: how particles start; the lattice if none is given.
        kernel: Wendland C2 if none is given.
        mach: Mach number U / c0.
        scheme: of `jaxsph.schemes`; `Consistent()` if none is given.
        dtype: float64 or float32; JAX's default if none is given.

    Raises:
        ValueError: for a Reynolds number or an amplitude, a resolution or a step out of range.
    """
    scheme = Consistent() if scheme is None else scheme
    positive(reynolds=reynolds, amplitude=amplitude, **{"t-end": end_time})
    if amplitude > 0.2 * DEPTH:
        raise ValueError(f"amplitude: at most 0.2 m for a linear wave, got {amplitude:g} m.")
    top = 2.0 * DEPTH
    vessel = BoxRegion((-math.inf, 0.0), (math.inf, top))

    def velocity(position):
        kx, ky = WAVE_NUMBER * position[:, 0], WAVE_NUMBER * position[:, 1]
        speed = amplitude * FREQUENCY / math.sinh(WAVE_NUMBER * DEPTH)
        return speed * jnp.stack([-jnp.sin(kx) * jnp.cosh(ky), jnp.cos(kx) * jnp.sinh(ky)], axis=1)

    effects = scheme.free_surface_effects(
        LaminarViscosity(jnp.asarray(1.0 / reynolds)),
        force=Gravity(jnp.asarray([0.0, -GRAVITY])),
        vessel=vessel,
    )

    return composed(
        "standing-wave",
        effects=effects,
        box=Box((0.0, 0.0), (2.0, top), (True, False)),
        scale=pick_scale(SCALES, scale).with_overrides(end_time, resolution, h_over_dx, time_step),
        end_time=end_time,
        reference_density=REFERENCE_DENSITY,
        reference_speed=1.0,
        mach=mach,
        side=2.0,
        region=BoxRegion((-math.inf, -math.inf), (math.inf, DEPTH)),
        walls=lambda space: Walls.around(vessel, space),
        velocity=velocity,
        pressure=lambda x: REFERENCE_DENSITY * GRAVITY * (DEPTH - x[:, 1]),
        arrangement=Lattice() if arrangement is None else arrangement,
        kernel=kernel,
        dtype=dtype,
        parameters={
            "scale": scale,
            "reynolds": reynolds,
            "amplitude": amplitude,
            "scheme": record(scheme),
        },
    )
