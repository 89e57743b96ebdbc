"""A tank that fills through a port in its wall."""

from __future__ import annotations

import math

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..arrangements import Arrangement, Lattice
from ..domain import Box
from ..effects import (
    Gravity,
    LaminarViscosity,
    Opening,
    Openings,
    ParabolicProfile,
    Varying,
    WettedWalls,
)
from ..kernels import Kernel, WendlandC2
from ..parking import Parking
from ..ramps import ramp
from ..record import record
from ..schemes import Consistent, Scheme
from ..walls import BoxRegion, Walls
from .composed import composed, pick_scale, positive
from .ends import buffer_lengths, buffer_rate, put_at_openings
from .scales import Scale
from .scene import Scene

REFERENCE_DENSITY, GRAVITY = 1000.0, 9.81  # kg/m^3, m/s^2
LENGTH, TOP, DEPTH, PORT = 1.0, 1.0, 0.4, 0.2  # m
SPEED = math.sqrt(GRAVITY * TOP)  # m/s, what the Mach number is of
OPENS = 0.5  # s, within which the inflow comes to its full strength
_WHOLE = 5  # particles along the tank: one across a fifth of it
_MORE = 1.02  # times the particles that come in, parked at the start
SCALES = {
    "small": Scale(resolution=40, h_over_dx=2.0, time_step=1e-3, steps_per_snapshot=100),
    "half": Scale(resolution=80, h_over_dx=2.0, time_step=5e-4, steps_per_snapshot=200),
    "paper": Scale(resolution=160, h_over_dx=2.0, time_step=2.5e-4, steps_per_snapshot=400),
}


class Opened(eqx.Module):
    """From 0 at rest to 1 after `OPENS` s, smooth."""

    def __call__(self, time: Float[Array, ""]) -> Float[Array, ""]:
        return ramp(time, 0.0, OPENS)


def level(time: Float[np.ndarray, " times"], inflow: float) -> Float[np.ndarray, " times"]:
    """The mean height of the surface [m], by what has come in: H + U b / L times the integral of
    the inflow's strength, b = 0.2 m the port's height and L = 1 m the tank's length.

    Args:
        time: [s].
        inflow: U, mean speed in the port [m/s].
    """
    way = np.clip(np.asarray(time) / OPENS, 0.0, 1.0)
    lasted = OPENS * (way**3 - 0.5 * way**4) + np.maximum(np.asarray(time) - OPENS, 0.0)
    return DEPTH + inflow * PORT / LENGTH * lasted


def filling_tank(
    resolution: int | None = None,
    reynolds: float = 1000.0,
    *,
    inflow: float = 0.25,
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
    """Water comes into a tank 1 m wide through a port 0.2 m high at the foot of its left wall.

    Water 0.4 m deep is at rest at the start; the inflow, a parabola, comes to its full strength
    within 0.5 s. rho0 = 1000 kg/m^3, g = 9.81 m/s^2, Re = U b / nu with the port's height b; walls
    have no friction. All particles that will come in are parked at the start (`Openings`). A gauge
    (`jaxsph.metrics.surface_height`) should stand some spacings off the left wall, as it mirrors at
    the box's end, not there. `jaxsph.scenes.filling_tank.level` is how high the water must stand.

    Args:
        resolution: particles along the tank, a multiple of 5; overrides the scale's, time step
            scaled along.
        reynolds: Reynolds number.
        inflow: mean speed in the port [m/s].
        scale: `small` (40), `half` (80) or `paper` (160 particles along it).
        h_over_dx: smoothing length over spacing; overrides the scale's.
        time_step: dt [s]; overrides the scale's.
        end_time: [s].
        arrangement: how particles start; the lattice if none is given.
        kernel: Wendland C2 if none is given.
        mach: Mach number (g m)^(1/2) / c0.
        scheme: of `jaxsph.schemes`; `Consistent()` if none is given.
        dtype: float64 or float32; JAX's default if none is given.

    Raises:
        ValueError: for a Reynolds number, an inflow, a resolution or a step out of range, and where
            the tank would overflow.
    """
    scheme = Consistent() if scheme is None else scheme
    kernel = WendlandC2() if kernel is None else kernel
    positive(reynolds=reynolds, inflow=inflow, **{"t-end": end_time})
    chosen = pick_scale(SCALES, scale).with_overrides(end_time, resolution, h_over_dx, time_step)
    if chosen.resolution % _WHOLE:
        raise ValueError(
            f"resolution: a multiple of {_WHOLE}, so that the port and the water are whole rows of "
            f"particles, got {chosen.resolution}."
        )
    dx = LENGTH / chosen.resolution
    support = kernel.support * chosen.h_over_dx * dx
    highest = float(level(np.asarray(end_time), inflow))
    if highest > TOP - support:
        raise ValueError(
            f"t-end: by {end_time:g} s the water stands {highest:.3g} m high in a tank of {TOP:g} "
            "m; end before, or let less come in."
        )
    front, reserve = buffer_lengths(support, dx)
    behind = front + reserve
    tank = BoxRegion((0.0, 0.0), (LENGTH, TOP))
    port = BoxRegion((-np.inf, 0.0), (0.5 * LENGTH, PORT))  # into the tank: no seam between them
    effects = scheme.free_surface_effects(
        LaminarViscosity(jnp.asarray(inflow * PORT / reynolds)),
        force=Gravity(jnp.asarray([0.0, -GRAVITY])),
        vessel=tank | port,
    )
    box = Box((-behind, 0.0), (LENGTH, TOP), (False, False))
    start = BoxRegion((0.0, 0.0), (LENGTH, DEPTH)) | port
    scene = composed(
        "filling-tank",
        effects=(*effects, WettedWalls()),
        box=box,
        scale=chosen,
        end_time=end_time,
        reference_density=REFERENCE_DENSITY,
        reference_speed=SPEED,
        mach=mach,
        side=LENGTH,
        region=start,
        walls=lambda space: Walls.around(tank | port, space, opening=port),
        pressure=lambda x: REFERENCE_DENSITY * GRAVITY * (DEPTH - x[:, 1]),
        arrangement=Lattice() if arrangement is None else arrangement,
        kernel=kernel,
        dtype=dtype,
        parameters={
            "scale": scale,
            "reynolds": reynolds,
            "inflow": inflow,
            "scheme": record(scheme),
        },
    )
    profile = Varying(ParabolicProfile(jnp.asarray(1.5 * inflow), PORT), Opened())
    inlet = Opening(
        profile, None, None, box.lower, (0.0, PORT), axis=0, inward=1.0, reserve=reserve, cell=dx
    )
    coming = (highest - DEPTH) * LENGTH / scene.space.cell_volume
    ends = Openings((inlet,), buffer_rate(scene), Parking(box))
    return put_at_openings(scene, ends, start, _MORE * coming)
