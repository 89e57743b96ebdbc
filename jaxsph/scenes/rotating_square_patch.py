"""The rotating square patch: fluid under tension, with a free surface all round."""

from __future__ import annotations

import numpy as np

from ..arrangements import Arrangement, Lattice
from ..domain import Box
from ..kernels import Kernel
from ..record import record
from ..schemes import Consistent, Scheme
from ..walls import BoxRegion
from .composed import composed, pick_scale, positive
from .scales import Scale
from .scene import Scene

REFERENCE_DENSITY = 1000.0  # kg/m^3
ROTATION = 1.0  # rad/s
SIDE = 1.0  # m
REACH = 2.5  # m from the centre to the faces of the box, which the arms do not touch
_TERMS = 60  # of the pressure's double series, in each direction
SCALES = {
    "small": Scale(resolution=50, h_over_dx=2.0, time_step=5e-3, steps_per_snapshot=10),
    "half": Scale(resolution=100, h_over_dx=2.0, time_step=2.5e-3, steps_per_snapshot=20),
    "paper": Scale(resolution=200, h_over_dx=2.0, time_step=1.25e-3, steps_per_snapshot=40),
}


def patch_pressure(position):
    """p [Pa] at the start: lap p = 2 rho0 omega^2 in the square, p = 0 on its sides.

        p = -rho0 sum_{m,n odd} 32 omega^2 / (m n pi^2) / ((m pi/L)^2 + (n pi/L)^2)
            sin(m pi x/L) sin(n pi y/L),

    x and y from a corner (Colagrossi 2005).
    """
    odd = 2.0 * np.arange(_TERMS) + 1.0
    x = np.asarray(position, np.float64) / SIDE + 0.5
    waves = [np.sin(np.pi * odd * x[:, k, None]) for k in (0, 1)]
    shared = odd[:, None] ** 2 + odd[None, :] ** 2
    weight = 32.0 * (ROTATION * SIDE) ** 2 / np.pi**4 / (odd[:, None] * odd[None, :] * shared)
    return -REFERENCE_DENSITY * np.einsum("pm,mn,pn->p", waves[0], weight, waves[1])


def patch_velocity(position):
    """u = omega (y, -x) [m/s]."""
    x = np.asarray(position, np.float64)
    return ROTATION * np.stack([x[:, 1], -x[:, 0]], axis=1)


def rotating_square_patch(
    resolution: int | None = None,
    *,
    scale: str = "small",
    h_over_dx: float | None = None,
    time_step: float | None = None,
    end_time: float = 4.0,
    arrangement: Arrangement | None = None,
    kernel: Kernel | None = None,
    mach: float = 0.1,
    scheme: Scheme | None = None,
    dtype=None,
) -> Scene:
    """A square of fluid, 1 m wide, that turns as a solid would at 1 rad/s (Colagrossi 2005).

    Nothing holds it: its middle is under tension, its corners grow into arms. rho0 = 1000 kg/m^3,
    U = omega L / 2^(1/2) is the speed of a corner. No viscosity is listed.

    Args:
        resolution: particles along a side; overrides the scale's, time step scaled along.
        scale: `small` (50), `half` (100) or `paper` (200 particles along it).
        h_over_dx: smoothing length over spacing; overrides the scale's.
        time_step: dt [s]; overrides the scale's.
        end_time: [s].
        arrangement: how particles start; the lattice if none is given.
        kernel: Wendland C2 if none is given.
        mach: Mach number U / c0.
        scheme: of `jaxsph.schemes`; `Consistent()` if none is given.
        dtype: float64 or float32; JAX's default if none is given.

    Raises:
        ValueError: for an end time, a resolution or a step out of range.
    """
    scheme = Consistent() if scheme is None else scheme
    positive(**{"t-end": end_time})
    half = 0.5 * SIDE
    return composed(
        "rotating-square-patch",
        effects=scheme.free_surface_effects(),
        box=Box((-REACH, -REACH), (REACH, REACH), (False, False)),
        scale=pick_scale(SCALES, scale).with_overrides(end_time, resolution, h_over_dx, time_step),
        end_time=end_time,
        reference_density=REFERENCE_DENSITY,
        reference_speed=ROTATION * SIDE / 2.0**0.5,
        mach=mach,
        side=SIDE,
        region=BoxRegion((-half, -half), (half, half)),
        velocity=patch_velocity,
        pressure=patch_pressure,
        arrangement=Lattice() if arrangement is None else arrangement,
        kernel=kernel,
        dtype=dtype,
        parameters={"scale": scale, "scheme": record(scheme)},
    )
