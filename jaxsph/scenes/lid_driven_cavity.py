"""The lid-driven cavity."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np

from ..arrangements import Arrangement
from ..domain import Box
from ..kernels import Kernel
from ..schemes import Scheme
from ..walls import BoxRegion, MovingWall
from .composed import pick_scale, positive
from .enclosed import enclosed_flow
from .scales import Scale
from .scene import Scene

SCALES = {
    "small": Scale(resolution=50, h_over_dx=2.0, time_step=2e-3, steps_per_snapshot=10),
    "half": Scale(resolution=100, h_over_dx=2.0, time_step=4e-4, steps_per_snapshot=25),
    "paper": Scale(resolution=200, h_over_dx=2.0, time_step=2e-4, steps_per_snapshot=50),
}


def regularised_lid(x):
    """U(x) = (1 - (2x - 1)^14)^2 on [0, 1], zero beyond (paper; Lind and Stansby 2016)."""
    return (1.0 - jnp.clip(2.0 * x - 1.0, -1.0, 1.0) ** 14) ** 2


def constant_lid(x):
    """U = 1 on (0, 1), zero beyond."""
    return jnp.where((x > 0.0) & (x < 1.0), 1.0, 0.0).astype(x.dtype)


LIDS = {"regularised": regularised_lid, "constant": constant_lid}


def lid_driven_cavity(
    resolution: int | None = None,
    reynolds: float = 100.0,
    *,
    scale: str = "small",
    lid: str = "regularised",
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
    """The unit square of fluid under a sliding lid (paper, second experiment).

    Re = U L / nu with U = 1 m/s and L = 1 m; rho0 = 1 kg/m^3; no-slip walls; from rest.

    Args:
        resolution: particles per side; overrides the scale's, time step scaled along.
        reynolds: Reynolds number.
        scale: `small` (50 x 50), `half` (100 x 100) or `paper` (200 x 200).
        lid: `regularised`, the paper's profile, or `constant`, that of Ghia et al. (1982).
        h_over_dx: smoothing length over spacing; overrides the scale's.
        time_step: dt [s]; overrides the scale's.
        end_time: [s].
        layers: of ghosts; a full support's if none is given (the paper has three).
        arrangement: how particles start; the lattice if none is given.
        kernel: Wendland C2 if none is given.
        scheme: of `jaxsph.schemes`; `Consistent()` if none is given.
        mach: Mach number U / c0.
        dtype: float64 or float32; JAX's default if none is given.

    Raises:
        ValueError: for a Reynolds number, resolution, lid or step out of range.
    """
    positive(reynolds=reynolds, **{"t-end": end_time})
    if lid not in LIDS:
        raise ValueError(f"lid: one of {', '.join(LIDS)}, got {lid!r}.")
    chosen = pick_scale(SCALES, scale).with_overrides(end_time, resolution, h_over_dx, time_step)
    profile = LIDS[lid]

    def velocity(position):
        speed = profile(position[:, 0])
        return jnp.stack([speed, jnp.zeros_like(speed)], axis=1)

    return enclosed_flow(
        "lid-driven-cavity",
        box=Box((0.0, 0.0), (1.0, 1.0), (False, False)),
        fluid_region=BoxRegion((0.0, 0.0), (1.0, 1.0)),
        moving=(MovingWall(BoxRegion((-np.inf, 1.0), (np.inf, np.inf)), velocity),),
        scale=chosen,
        end_time=end_time,
        reference_density=1.0,
        reference_speed=1.0,
        mach=mach,
        viscosity=1.0 / reynolds,
        layers=layers,
        arrangement=arrangement,
        kernel=kernel,
        scheme=scheme,
        dtype=dtype,
        parameters={"scale": scale, "reynolds": reynolds, "lid": lid},
    )
