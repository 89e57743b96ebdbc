"""A box floats in a tank."""

from __future__ import annotations

import math

import jax.numpy as jnp

from ..arrangements import Arrangement, Lattice
from ..domain import Box
from ..effects import ArtificialViscosity, Gravity
from ..kernels import Kernel
from ..record import record
from ..schemes import Consistent, Scheme
from ..walls import BoxRegion, FreeBody, WallPart, Walls
from .composed import composed, pick_scale, positive
from .scales import Scale
from .scene import Scene

REFERENCE_DENSITY = 1000.0  # kg/m^3
GRAVITY = 9.81  # m/s^2
LENGTH, TOP = 1.2, 1.0  # m, of the tank
DEPTH = 0.5  # m of water where there were no box
WIDTH, HEIGHT = 0.4, 0.2  # m, of the box
SCALES = {
    "small": Scale(resolution=60, h_over_dx=2.0, time_step=2e-3, steps_per_snapshot=10),
    "half": Scale(resolution=120, h_over_dx=2.0, time_step=1e-3, steps_per_snapshot=20),
    "paper": Scale(resolution=240, h_over_dx=2.0, time_step=5e-4, steps_per_snapshot=40),
}


def draught(density: float) -> float:
    """Depth [m] of the box's bottom under the water line at rest (Archimedes):

    T = H rho / rho0, rho the box's density [kg/m^3]; all of H where it is heavier than water.
    """
    return HEIGHT * min(1.0, density / REFERENCE_DENSITY)


def water_level(density: float, lift: float) -> float:
    """The water line [m] of the box at rest, released from `lift` [m] above the place where it
    would rest in a tank without end."""
    submerged = draught(density) - lift
    return DEPTH + WIDTH * (draught(density) - min(max(submerged, 0.0), HEIGHT)) / LENGTH


def floating_box(
    resolution: int | None = None,
    *,
    density: float = 500.0,
    lift: float = 0.04,
    alpha: float = 0.02,
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
    """A box 0.4 m wide and 0.2 m high in a tank 1.2 m wide with water 0.5 m deep, heaving.

    It is let go from rest, `lift` above where it floats, and the fluid moves and turns it
    (`FreeBody`). rho0 = 1000 kg/m^3, g = 9.81 m/s^2, U = (g d)^(1/2); walls have no friction. One
    heavier than water sinks, and its run ends in a fault at the floor: contact is not modelled.

    Args:
        resolution: particles along the tank; overrides the scale's, time step scaled along.
        density: of the box [kg/m^3]; a light one needs a shorter step, as the error says.
        lift: of the box at the start above its place at rest, with the water level [m]; below it
            if negative.
        alpha: strength of the artificial viscosity.
        scale: `small` (60), `half` (120) or `paper` (240 particles along it).
        h_over_dx: smoothing length over spacing; overrides the scale's.
        time_step: dt [s]; overrides the scale's.
        end_time: [s].
        arrangement: how particles start; the lattice if none is given.
        kernel: Wendland C2 if none is given.
        mach: Mach number U / c0.
        scheme: of `jaxsph.schemes`; `Consistent()` if none is given.
        dtype: float64 or float32; JAX's default if none is given.

    Raises:
        ValueError: for a density, a lift, a resolution or a step out of range.
    """
    scheme = Consistent() if scheme is None else scheme
    positive(density=density, alpha=alpha, **{"t-end": end_time})
    bottom = DEPTH - draught(density) + lift
    chosen = pick_scale(SCALES, scale).with_overrides(
        end_time, resolution, h_over_dx, time_step
    )
    room = 2.0 * chosen.h_over_dx * LENGTH / chosen.resolution  # of the kernel's support
    if not (bottom > room and bottom + HEIGHT < TOP - room):
        raise ValueError(
            f"lift: {lift:g} m puts the box from {bottom:g} to {bottom + HEIGHT:g} m, and it must "
            f"start the kernel's support of {room:.3g} m off the floor and the lid at {TOP:g} m."
        )
    left = 0.5 * (LENGTH - WIDTH)
    tank = BoxRegion((0.0, 0.0), (LENGTH, TOP))
    body = BoxRegion((left, bottom), (left + WIDTH, bottom + HEIGHT))
    effects = scheme.free_surface_effects(
        ArtificialViscosity(jnp.asarray(alpha, float)),
        force=Gravity(jnp.asarray([0.0, -GRAVITY])),
        vessel=tank,
    )
    return composed(
        "floating-box",
        effects=effects,
        box=Box((0.0, 0.0), (LENGTH, TOP), (False, False)),
        scale=chosen,
        end_time=end_time,
        reference_density=REFERENCE_DENSITY,
        reference_speed=math.sqrt(GRAVITY * DEPTH),
        mach=mach,
        region=BoxRegion((0.0, 0.0), (LENGTH, DEPTH)) & ~body,
        walls=lambda space: Walls.around(
            tank,
            space,
            parts=(WallPart("box", body),),
            free_bodies=(FreeBody.of_density(body, density, space),),
        ),
        pressure=lambda x: REFERENCE_DENSITY * GRAVITY * (DEPTH - x[:, 1]),
        arrangement=Lattice() if arrangement is None else arrangement,
        kernel=kernel,
        dtype=dtype,
        parameters={
            "scale": scale,
            "density": density,
            "lift": lift,
            "alpha": alpha,
            "scheme": record(scheme),
        },
    )
