"""Couette flow: between a plate at rest and one that starts to slide."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np

from ..arrangements import Arrangement, JitteredLattice
from ..domain import Box
from ..effects import Effect
from ..effects.base import VISCOUS_LIMIT
from ..kernels import Kernel
from ..record import record
from ..schemes import Scheme
from ..walls import BoxRegion, MovingWall
from .composed import pick_scale, positive
from .enclosed import enclosed_flow
from .plane_flow_solution import CouetteFlow
from .scales import Scale
from .scene import Scene

LENGTH = 0.4  # m, of the periodic direction
SCALES = {
    "small": Scale(resolution=50, h_over_dx=2.0, time_step=1.6e-3, steps_per_snapshot=10),
    "half": Scale(resolution=100, h_over_dx=2.0, time_step=4e-4, steps_per_snapshot=40),
    "paper": Scale(resolution=200, h_over_dx=2.0, time_step=1e-4, steps_per_snapshot=160),
}
CHANNEL = BoxRegion((-np.inf, 0.0), (np.inf, 1.0))


def couette(
    resolution: int | None = None,
    reynolds: float = 10.0,
    *,
    scale: str = "small",
    h_over_dx: float | None = None,
    time_step: float | None = None,
    end_time: float = 2.0,
    layers: int | None = None,
    wall_velocity: Effect | None = None,
    arrangement: Arrangement | None = None,
    kernel: Kernel | None = None,
    scheme: Scheme | None = None,
    mach: float = 0.1,
    dtype=None,
) -> Scene:
    """Couette flow from rest: a channel 1 m high whose upper wall slides with U = 1 m/s.

    Re = U H / nu; periodic along the channel; rho0 = 1 kg/m^3. Between walls of
    the scheme's own no-slip `plane_flow_solution.couette` is its exact solution.

    Args:
        resolution: particles across; overrides the scale's, time step scaled along.
        reynolds: Reynolds number.
        scale: `small` (50 across), `half` (100) or `paper` (200).
        h_over_dx: smoothing length over spacing; overrides the scale's.
        time_step: dt [s]; overrides the scale's.
        end_time: [s].
        layers: of ghosts; a full support's if none is given.
        wall_velocity: how viscosity sees the walls; the scheme's own no-slip if none is given.
        arrangement: how particles start; a jittered lattice if none is given (on a lattice in
            line with the flow the viscous sum is off by some percent at h = 2 dx).
        kernel: Wendland C2 if none is given.
        scheme: of `jaxsph.schemes`; `Consistent()` if none is given.
        mach: Mach number U / c0.
        dtype: float64 or float32; JAX's default if none is given.

    Raises:
        ValueError: for a Reynolds number, resolution or step out of range.
    """
    positive(reynolds=reynolds, **{"t-end": end_time})
    chosen = channel_scale(scale, reynolds, end_time, resolution, h_over_dx, time_step)
    return enclosed_flow(
        "couette",
        box=channel_box(chosen),
        fluid_region=CHANNEL,
        side=1.0,
        moving=(MovingWall(BoxRegion((-np.inf, 1.0), (np.inf, np.inf)), _sliding),),
        scale=chosen,
        end_time=end_time,
        reference_density=1.0,
        reference_speed=1.0,
        mach=mach,
        viscosity=1.0 / reynolds,
        wall_velocity=wall_velocity,
        layers=layers,
        arrangement=JitteredLattice(amplitude=0.25) if arrangement is None else arrangement,
        kernel=kernel,
        scheme=scheme,
        dtype=dtype,
        solution=CouetteFlow(1.0 / reynolds) if wall_velocity is None else None,
        parameters={
            "scale": scale,
            "reynolds": reynolds,
            "wall_velocity": None if wall_velocity is None else record(wall_velocity),
        },
    )


def channel_scale(scale, reynolds, end_time, resolution, h_over_dx, time_step) -> Scale:
    """The scale of a channel of unit height and speed; dt respects the viscous limit, too."""

    def longest_step(scale):
        return 0.9 * VISCOUS_LIMIT * (scale.h_over_dx / scale.resolution) ** 2 * reynolds

    return pick_scale(SCALES, scale).with_overrides(
        end_time, resolution, h_over_dx, time_step, longest_step
    )


def channel_box(scale: Scale) -> Box:
    """The unit height and a whole number of spacings, about `LENGTH`, along the channel.

    It is at least as long as the neighbour search needs.
    """
    fewest = int(np.ceil(2.0 * (2.0 * scale.h_over_dx + 1.0))) + 1
    count = max(fewest, round(LENGTH * scale.resolution))
    return Box((0.0, 0.0), (count / scale.resolution, 1.0), (True, False))


def _sliding(position):
    return jnp.zeros_like(position).at[:, 0].set(1.0)
