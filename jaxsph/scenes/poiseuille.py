"""Poiseuille flow: between plates at rest, driven by a body force."""

from __future__ import annotations

import jax.numpy as jnp

from ..arrangements import Arrangement, JitteredLattice
from ..effects import Effect, Gravity
from ..kernels import Kernel
from ..record import record
from ..schemes import Scheme
from .couette import CHANNEL, channel_box, channel_scale
from .enclosed import enclosed_flow, positive
from .plane_flow_solution import PoiseuilleFlow
from .scene import Scene


def poiseuille(
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
    """Poiseuille flow from rest: a channel 1 m high under a force that drives it to U = 1 m/s.

    b = 8 nu U / H^2 along the channel, so that the steady profile peaks at U; Re = U H / nu;
    rho0 = 1 kg/m^3. Between walls of the scheme's own no-slip `plane_flow_solution.poiseuille` is
    its exact solution.

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
    viscosity = 1.0 / reynolds
    chosen = channel_scale(scale, reynolds, end_time, resolution, h_over_dx, time_step)
    return enclosed_flow(
        "poiseuille",
        box=channel_box(chosen),
        fluid_region=CHANNEL,
        side=1.0,
        force=Gravity(jnp.asarray([8.0 * viscosity, 0.0])),
        scale=chosen,
        end_time=end_time,
        reference_density=1.0,
        reference_speed=1.0,
        mach=mach,
        viscosity=viscosity,
        wall_velocity=wall_velocity,
        layers=layers,
        arrangement=JitteredLattice(amplitude=0.25) if arrangement is None else arrangement,
        kernel=kernel,
        scheme=scheme,
        dtype=dtype,
        solution=None if wall_velocity is not None else PoiseuilleFlow(viscosity, 8.0 * viscosity),
        parameters={
            "scale": scale,
            "reynolds": reynolds,
            "wall_velocity": None if wall_velocity is None else record(wall_velocity),
        },
    )
