"""The Taylor-Green vortices: the paper's in two dimensions, and the one in three."""

from __future__ import annotations

from ..arrangements import Arrangement
from ..domain import Box
from ..kernels import Kernel
from ..record import record
from ..schemes import Consistent, Scheme
from . import taylor_green_solution as exact
from .composed import composed, pick_scale, positive
from .scales import Scale
from .scene import Scene

REFERENCE_DENSITY = 1000.0  # kg/m^3
REFERENCE_SPEED = 1.0  # m/s
SCALES = {
    "small": Scale(resolution=64, h_over_dx=2.0, time_step=2.5e-3, steps_per_snapshot=2),
    "half": Scale(resolution=150, h_over_dx=4.0, time_step=1e-3, steps_per_snapshot=5),
    "paper": Scale(resolution=300, h_over_dx=4.0, time_step=5e-4, steps_per_snapshot=10),
}
SCALES_3D = {
    "small": Scale(resolution=20, h_over_dx=2.0, time_step=5e-3, steps_per_snapshot=5),
    "half": Scale(resolution=40, h_over_dx=2.0, time_step=2.5e-3, steps_per_snapshot=10),
    "paper": Scale(resolution=64, h_over_dx=2.0, time_step=1.5e-3, steps_per_snapshot=20),
}


def taylor_green(
    resolution: int | None = None,
    reynolds: float = 100.0,
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
    """The decaying Taylor-Green vortex on the periodic unit square (paper, first experiment).

    Re = U L / nu with U = 1 m/s and L = 1 m; rho0 = 1000 kg/m^3.
    The initial density follows from the exact pressure.

    Args:
        resolution: particles per side; overrides the scale's, time step scaled along.
        reynolds: Reynolds number.
        scale: `small` (64 x 64), `half` (150 x 150) or `paper` (300 x 300).
        h_over_dx: smoothing length over spacing; overrides the scale's.
        time_step: dt [s]; overrides the scale's.
        end_time: [s].
        arrangement: how particles start; packed if none is given.
        kernel: Wendland C2 if none is given.
        scheme: of `jaxsph.schemes`; `Consistent()` if none is given.
        mach: Mach number U / c0.
        dtype: float64 or float32; JAX's default if none is given.

    Raises:
        ValueError: for a Reynolds number, resolution or step out of range.
    """
    return _vortex("taylor-green", 2, SCALES, **locals())


def taylor_green_3d(
    resolution: int | None = None,
    reynolds: float = 100.0,
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
    """The Taylor-Green vortex on the periodic unit cube; arguments as `taylor_green`."""
    return _vortex("taylor-green-3d", 3, SCALES_3D, **locals())


def _vortex(
    name, dim, scales, *, resolution, reynolds, scale, h_over_dx, time_step, end_time,
    arrangement, kernel, scheme, mach, dtype,
):  # fmt: skip
    positive(reynolds=reynolds, mach=mach, **{"t-end": end_time})
    chosen = pick_scale(scales, scale).with_overrides(end_time, resolution, h_over_dx, time_step)
    viscosity, density = 1.0 / reynolds, REFERENCE_DENSITY
    vortex = exact.DecayingVortex(viscosity, density) if dim == 2 else None
    if scheme is None:
        scheme = Consistent()

    def velocity(position):
        return vortex(position, 0.0)[0] if dim == 2 else exact.initial_velocity_3d(position)

    def pressure(position):
        if dim == 2:
            return vortex(position, 0.0)[1]
        return exact.initial_pressure_3d(position, density)

    return composed(
        name,
        effects=scheme.effects(viscosity),
        box=Box.unit_periodic(dim),
        scale=chosen,
        end_time=end_time,
        reference_density=density,
        reference_speed=REFERENCE_SPEED,
        mach=mach,
        velocity=velocity,
        pressure=pressure,
        arrangement=arrangement,
        kernel=kernel,
        dtype=dtype,
        solution=vortex,
        parameters={"scale": scale, "reynolds": reynolds, "scheme": record(scheme)},
    )
