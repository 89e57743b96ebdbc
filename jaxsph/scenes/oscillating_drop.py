"""A drop that its surface tension makes oscillate."""

from __future__ import annotations

import math

import jax.numpy as jnp

from ..arrangements import Arrangement, Rings
from ..domain import Box
from ..effects import (
    Continuity,
    DensityDiffusion,
    FreeSurface,
    LaminarViscosity,
    PressureForce,
    SurfaceDiffusion,
    SurfaceTension,
)
from ..kernels import Kernel
from ..schemes.delta_plus import DELTA
from ..walls import BallRegion
from .composed import composed, pick_scale, positive
from .scales import Scale
from .scene import Scene

REFERENCE_DENSITY = 1.0  # kg/m^3
TENSION = 1.0  # N/m
RADIUS = 1.0  # m
REACH = 2.0  # m from the centre to the faces of the box
PERIOD = 2.0 * math.pi * math.sqrt(REFERENCE_DENSITY * RADIUS**3 / (6.0 * TENSION))  # s
SCALES = {
    "small": Scale(resolution=50, h_over_dx=2.0, time_step=8e-3, steps_per_snapshot=5),
    "half": Scale(resolution=100, h_over_dx=2.0, time_step=2.5e-3, steps_per_snapshot=10),
    "paper": Scale(resolution=200, h_over_dx=2.0, time_step=1e-3, steps_per_snapshot=20),
}


def oscillating_drop(
    resolution: int | None = None,
    reynolds: float = 50.0,
    *,
    amplitude: float = 0.03,
    scale: str = "small",
    h_over_dx: float | None = None,
    time_step: float | None = None,
    end_time: float = 6.0,
    arrangement: Arrangement | None = None,
    kernel: Kernel | None = None,
    mach: float = 0.1,
    dtype=None,
) -> Scene:
    """A round drop in two dimensions that is squeezed to and fro by its surface tension.

    It starts round with u = A w (x, -y) / R. Small oscillations go with w^2 = 6 sigma / (rho0 R^3)
    (Rayleigh 1879, Lamb 1932, n = 2 in the plane) and decay as exp(-4 nu t / R^2). rho0 = 1 kg/m^3,
    sigma = 1 N/m, R = 1 m, U = (sigma / (rho0 R))^(1/2), Re = U R / nu. Particles are not shifted:
    the rows that carry the tension lie evenly by themselves as long as the oscillation is small.

    Args:
        resolution: particles along the diameter; overrides the scale's, time step scaled along.
        reynolds: Reynolds number.
        amplitude: A / R of the oscillation.
        scale: `small` (50), `half` (100) or `paper` (200 particles along it).
        h_over_dx: smoothing length over spacing; overrides the scale's.
        time_step: dt [s]; overrides the scale's.
        end_time: [s].
        arrangement: how particles start; rings if none is given.
        kernel: Wendland C2 if none is given.
        mach: Mach number U / c0.
        dtype: float64 or float32; JAX's default if none is given.

    Raises:
        ValueError: for a Reynolds number or an amplitude, a resolution or a step out of range.
    """
    positive(reynolds=reynolds, amplitude=amplitude, **{"t-end": end_time})
    if amplitude > 0.3:
        raise ValueError(f"amplitude: at most 0.3 of the radius, got {amplitude:g}.")
    strain = amplitude * 2.0 * math.pi / PERIOD

    def capillary_step(scale: Scale) -> float:
        h = scale.h_over_dx * 2.0 * RADIUS / scale.resolution
        return 0.9 * math.sqrt(REFERENCE_DENSITY * h**3 / (2.0 * math.pi * TENSION))

    effects = (
        Continuity(),
        PressureForce(),
        LaminarViscosity(jnp.asarray(1.0 / reynolds)),
        DensityDiffusion(jnp.asarray(DELTA)),
        FreeSurface(),
        SurfaceDiffusion(),
        SurfaceTension(jnp.asarray(TENSION)),
    )

    return composed(
        "oscillating-drop",
        effects=effects,
        box=Box((-REACH, -REACH), (REACH, REACH), (False, False)),
        scale=pick_scale(SCALES, scale).with_overrides(end_time, resolution, h_over_dx, time_step),
        end_time=end_time,
        reference_density=REFERENCE_DENSITY,
        reference_speed=strain * RADIUS,
        mach=mach,
        sound_speed=math.sqrt(TENSION / (REFERENCE_DENSITY * RADIUS)) / mach,
        side=2.0 * RADIUS,
        region=BallRegion((0.0, 0.0), RADIUS),
        velocity=lambda x: strain * x * jnp.asarray([[1.0, -1.0]]),
        pressure=lambda x: jnp.full(len(x), TENSION / RADIUS),
        arrangement=Rings(RADIUS) if arrangement is None else arrangement,
        kernel=kernel,
        dtype=dtype,
        parameters={"scale": scale, "reynolds": reynolds, "amplitude": amplitude},
    )
