"""A piston makes waves in a tank."""

from __future__ import annotations

import math
from typing import final

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float
from scipy.optimize import brentq

from ..arrangements import Arrangement, Lattice
from ..domain import Box
from ..effects import ArtificialViscosity, Gravity
from ..kernels import Kernel
from ..record import record
from ..schemes import Consistent, Scheme
from ..walls import BoxRegion, MovingBody, Walls
from .composed import composed, pick_scale, positive
from .scales import Scale
from .scene import Scene

REFERENCE_DENSITY = 1000.0  # kg/m^3
GRAVITY = 9.81  # m/s^2
DEPTH = 0.3  # m
LENGTH = 3.3  # m, from the piston at rest to the far wall
BEHIND = 0.3  # m of tank behind the piston's face
TOP = 0.45  # m, of the tank
SCALES = {
    "small": Scale(resolution=120, h_over_dx=2.0, time_step=3e-3, steps_per_snapshot=20),
    "half": Scale(resolution=240, h_over_dx=2.0, time_step=1.5e-3, steps_per_snapshot=40),
    "paper": Scale(resolution=480, h_over_dx=2.0, time_step=7.5e-4, steps_per_snapshot=80),
}


def wave_number(period: float) -> float:
    """k [rad/m] of w^2 = g k tanh(k d), the linear wave of a period [s]."""
    wanted = (2.0 * math.pi / period) ** 2 * DEPTH / GRAVITY
    return brentq(lambda kd: kd * math.tanh(kd) - wanted, 0.0, 1.0 + wanted) / DEPTH


def wave_height(stroke: float, period: float) -> float:
    """H [m] far from a piston of a stroke S [m], by linear theory (Dean and Dalrymple 1991, 6.2):

    H / S = 2 (cosh(2 k d) - 1) / (sinh(2 k d) + 2 k d).
    """
    twice = 2.0 * wave_number(period) * DEPTH
    return stroke * 2.0 * (math.cosh(twice) - 1.0) / (math.sinh(twice) + twice)


@final
class PistonStroke(eqx.Module):
    """d(t) = (S / 2) r(t / T) sin(2 pi t / T) e_x, r = s^2 (3 - 2 s) in the first period, then 1.

    Args:
        stroke: S [m], twice the amplitude.
        period: T [s].
    """

    stroke: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    period: Float[Array, ""] = eqx.field(converter=jnp.asarray)

    def __call__(self, time):
        periods = time / self.period
        share = jnp.clip(periods, 0.0, 1.0)
        ramp = share * share * (3.0 - 2.0 * share)
        way = 0.5 * self.stroke * ramp * jnp.sin(2.0 * jnp.pi * periods)
        return jnp.stack([way, jnp.zeros_like(way)])


def piston_wave_maker(
    resolution: int | None = None,
    *,
    stroke: float = 0.06,
    period: float = 1.2,
    alpha: float = 0.02,
    scale: str = "small",
    h_over_dx: float | None = None,
    time_step: float | None = None,
    end_time: float = 4.8,
    arrangement: Arrangement | None = None,
    kernel: Kernel | None = None,
    mach: float = 0.1,
    scheme: Scheme | None = None,
    dtype=None,
) -> Scene:
    """Water 0.3 m deep in a tank, its left wall a piston 3.3 m from the right one.

    The piston moves as `PistonStroke` says. rho0 = 1000 kg/m^3, g = 9.81 m/s^2, U = (g d)^(1/2);
    walls have no friction. The wave reflected by the right wall is back at the middle of the tank
    after about four periods.

    Args:
        resolution: particles along the tank and the 0.3 m behind the piston; overrides the scale's,
            time step scaled along.
        stroke: S [m], twice the piston's amplitude.
        period: T [s].
        alpha: strength of the artificial viscosity.
        scale: `small` (120), `half` (240) or `paper` (480 particles along it).
        h_over_dx: smoothing length over spacing; overrides the scale's.
        time_step: dt [s]; overrides the scale's.
        end_time: [s].
        arrangement: how particles start; the lattice if none is given.
        kernel: Wendland C2 if none is given.
        mach: Mach number U / c0.
        scheme: of `jaxsph.schemes`; `Consistent()` if none is given.
        dtype: float64 or float32; JAX's default if none is given.

    Raises:
        ValueError: for a stroke, a period, a resolution or a step out of range.
    """
    scheme = Consistent() if scheme is None else scheme
    positive(stroke=stroke, period=period, alpha=alpha, **{"t-end": end_time})
    if stroke > 0.1:
        raise ValueError(f"stroke: at most 0.1 m, or waves break at the piston; got {stroke:g} m.")
    tank = BoxRegion((-BEHIND, 0.0), (LENGTH, TOP))
    piston = BoxRegion((-math.inf, -math.inf), (0.0, math.inf))

    def walls(space):
        if BEHIND - 0.5 * stroke < space.support:
            raise ValueError(
                f"resolution: a kernel's support of {space.support:.3g} m reaches through the "
                f"{BEHIND:g} m behind the piston; raise the resolution or lower h/dx."
            )
        return Walls.around(tank, space, bodies=(MovingBody(piston, PistonStroke(stroke, period)),))

    effects = scheme.free_surface_effects(
        ArtificialViscosity(jnp.asarray(alpha, float)),
        force=Gravity(jnp.asarray([0.0, -GRAVITY])),
        vessel=tank,
    )

    return composed(
        "piston-wave-maker",
        effects=effects,
        box=Box((-BEHIND, 0.0), (LENGTH, TOP), (False, False)),
        scale=pick_scale(SCALES, scale).with_overrides(end_time, resolution, h_over_dx, time_step),
        end_time=end_time,
        reference_density=REFERENCE_DENSITY,
        reference_speed=math.sqrt(GRAVITY * DEPTH),
        mach=mach,
        region=BoxRegion((0.0, 0.0), (LENGTH, DEPTH)),
        walls=walls,
        pressure=lambda x: REFERENCE_DENSITY * GRAVITY * (DEPTH - x[:, 1]),
        arrangement=Lattice() if arrangement is None else arrangement,
        kernel=kernel,
        dtype=dtype,
        parameters={
            "scale": scale,
            "stroke": stroke,
            "period": period,
            "alpha": alpha,
            "scheme": record(scheme),
        },
    )
