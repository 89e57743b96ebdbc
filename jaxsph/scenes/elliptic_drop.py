"""A drop that stretches into an ellipse, free or pulled back by a central force."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from scipy.integrate import solve_ivp

from ..arrangements import Arrangement, Rings
from ..domain import Box
from ..effects import ArtificialViscosity, CentralForce
from ..kernels import Kernel
from ..record import record
from ..schemes import Consistent, Scheme
from ..walls import BallRegion
from .composed import composed, pick_scale, positive
from .scales import Scale
from .scene import Scene

REFERENCE_DENSITY = 1000.0  # kg/m^3
RADIUS = 1.0  # m
STRAIN = 1.0  # 1/s at the start
REACH = 2.5  # m from the centre to the faces of the box
SCALES = {
    "small": Scale(resolution=50, h_over_dx=2.0, time_step=5e-3, steps_per_snapshot=5),
    "half": Scale(resolution=100, h_over_dx=2.0, time_step=2.5e-3, steps_per_snapshot=10),
    "paper": Scale(resolution=200, h_over_dx=2.0, time_step=1.25e-3, steps_per_snapshot=20),
}


def semi_axes(time, pull: float):
    """Exact a(t) and b(t) [m], arrays like `time`, for u = A (x, -y), without viscosity:

        da/dt = A a,    db/dt = -A b,    dA/dt = (A^2 + Omega^2) (b^2 - a^2) / (a^2 + b^2)

    (Monaghan and Rafiee 2013), integrated to 1e-10.
    """

    def slope(_, y):
        a, b, strain = y
        return a * strain, -b * strain, (strain**2 + pull**2) * (b * b - a * a) / (a * a + b * b)

    time = np.asarray(time, np.float64)
    start = (RADIUS, RADIUS, STRAIN)
    solution = solve_ivp(
        slope, (0.0, max(time.max(), 1e-9)), start, "DOP853", time, rtol=1e-10, atol=1e-12
    )
    return solution.y[0], solution.y[1]


def elliptic_drop(
    resolution: int | None = None,
    *,
    pull: float = 1.0,
    alpha: float = 0.01,
    scale: str = "small",
    h_over_dx: float | None = None,
    time_step: float | None = None,
    end_time: float = 10.0,
    arrangement: Arrangement | None = None,
    kernel: Kernel | None = None,
    mach: float = 0.1,
    scheme: Scheme | None = None,
    dtype=None,
) -> Scene:
    """A round drop of 1 m radius that starts with u = (x, -y) 1/s and stretches to an ellipse.

    A force -Omega^2 x per mass pulls it back, so that it oscillates; without (`pull` 0) it is the
    classical elliptic drop (Monaghan 1994), which only stretches. `semi_axes` is the exact
    solution. rho0 = 1000 kg/m^3, U = 1.5 m/s.

    Args:
        resolution: particles along the diameter; overrides the scale's, time step scaled along.
        pull: Omega [rad/s].
        alpha: strength of the artificial viscosity.
        scale: `small` (50), `half` (100) or `paper` (200 particles along it).
        h_over_dx: smoothing length over spacing; overrides the scale's.
        time_step: dt [s]; overrides the scale's.
        end_time: [s].
        arrangement: how particles start; rings if none is given.
        kernel: Wendland C2 if none is given.
        mach: Mach number U / c0.
        scheme: of `jaxsph.schemes`; `Consistent()` if none is given.
        dtype: float64 or float32; JAX's default if none is given.

    Raises:
        ValueError: for a pull, a resolution or a step out of range.
    """
    scheme = Consistent() if scheme is None else scheme
    positive(alpha=alpha, **{"t-end": end_time})
    if not pull >= 0.0:
        raise ValueError(f"pull: zero or positive, got {pull:g} rad/s.")
    middle = 0.5 * REFERENCE_DENSITY * (STRAIN**2 + pull**2)  # Pa, times R^2 - r^2

    pulled = CentralForce(jnp.asarray(pull, float), (0.0, 0.0)) if pull > 0.0 else None
    viscosity = ArtificialViscosity(jnp.asarray(alpha, float))
    return composed(
        "elliptic-drop",
        effects=scheme.free_surface_effects(viscosity, force=pulled),
        box=Box((-REACH, -REACH), (REACH, REACH), (False, False)),
        scale=pick_scale(SCALES, scale).with_overrides(end_time, resolution, h_over_dx, time_step),
        end_time=end_time,
        reference_density=REFERENCE_DENSITY,
        reference_speed=1.5,
        mach=mach,
        side=2.0 * RADIUS,
        region=BallRegion((0.0, 0.0), RADIUS),
        velocity=lambda x: STRAIN * x * jnp.asarray([[1.0, -1.0]]),
        pressure=lambda x: middle * (RADIUS**2 - jnp.sum(x * x, axis=1)),
        arrangement=Rings(RADIUS) if arrangement is None else arrangement,
        kernel=kernel,
        dtype=dtype,
        parameters={"scale": scale, "pull": pull, "alpha": alpha, "scheme": record(scheme)},
    )
