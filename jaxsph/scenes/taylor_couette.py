"""Taylor-Couette flow: between two cylinders, of which one or both turn."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

import jax.numpy as jnp

from ..arrangements import Arrangement, Lattice
from ..domain import Box
from ..effects import Effect
from ..effects.base import VISCOUS_LIMIT
from ..kernels import Kernel
from ..record import record
from ..schemes import Scheme, SharpAtWalls
from ..walls import BallRegion, MovingWall, WallPart, Walls
from .composed import composed, in_rows, pick_scale, positive
from .scales import Scale
from .scene import Scene

REFERENCE_DENSITY = 1000.0  # kg/m^3
INNER, OUTER = 0.3, 0.6  # m, the cylinders' radii
HALF = 0.8  # m, of the box, which the walls' ghosts may go beyond
SCALES = {
    "small": Scale(resolution=12, h_over_dx=2.0, time_step=2.5e-3, steps_per_snapshot=20),
    "half": Scale(resolution=24, h_over_dx=2.0, time_step=1.25e-3, steps_per_snapshot=40),
    "paper": Scale(resolution=48, h_over_dx=2.0, time_step=6.25e-4, steps_per_snapshot=80),
}


@final
@dataclass(frozen=True)
class CircularCouetteFlow:
    """The steady flow between cylinders that turn (Landau and Lifshitz 1987, section 18):

        u = a r + b / r,    a = (w2 R2^2 - w1 R1^2) / (R2^2 - R1^2),
        b = (w1 - w2) R1^2 R2^2 / (R2^2 - R1^2),

    and its pressure, dp/dr = rho0 u^2 / r, zero on the inner cylinder. It is unchanged whatever
    the viscosity, and stable in two dimensions.

    Args:
        inner, outer: turns w1 and w2 of the cylinders of radius 0.3 and 0.6 m [rad/s].
    """

    inner: float
    outer: float

    @property
    def coefficients(self) -> tuple[float, float]:
        """a [1/s] and b [m^2/s]."""
        square1, square2 = INNER**2, OUTER**2
        a = (self.outer * square2 - self.inner * square1) / (square2 - square1)
        return a, (self.inner - self.outer) * square1 * square2 / (square2 - square1)

    def torque(self, viscosity: float) -> float:
        """Of the fluid on the inner cylinder, of a metre's depth [N m]; the opposite of that on
        the outer one:

            T = -4 pi rho0 nu b.

        Args:
            viscosity: nu [m^2/s].
        """
        return -4.0 * math.pi * REFERENCE_DENSITY * viscosity * self.coefficients[1]

    def __call__(self, position, time):
        """Velocity (N, 2) [m/s] and pressure (N,) [Pa] at positions (N, 2) [m], at any time."""
        a, b = self.coefficients
        square = jnp.sum(position**2, axis=1)
        around = jnp.stack([-position[:, 1], position[:, 0]], axis=1)

        def head(square):
            return 0.5 * a**2 * square + a * b * jnp.log(square) - 0.5 * b**2 / square

        pressure = REFERENCE_DENSITY * (head(square) - head(jnp.full_like(square, INNER**2)))
        return around * (a + b / square)[:, None], pressure


@dataclass(frozen=True)
class _Turn:
    """Velocity of a wall that turns about the origin with a rate [rad/s]."""

    rate: float

    def __call__(self, position):
        return self.rate * jnp.stack([-position[:, 1], position[:, 0]], axis=1)


def taylor_couette(
    resolution: int | None = None,
    reynolds: float = 1.8,
    *,
    inner: float = 1.0,
    outer: float = 0.0,
    ghosts: str = "rows",
    scale: str = "small",
    h_over_dx: float | None = None,
    time_step: float | None = None,
    end_time: float = 1.0,
    layers: int | None = None,
    wall_velocity: Effect | None = None,
    arrangement: Arrangement | None = None,
    kernel: Kernel | None = None,
    mach: float = 0.03,
    scheme: Scheme | None = None,
    dtype=None,
) -> Scene:
    """The flow between cylinders of radii 0.3 and 0.6 m that turn about the same axis.

    It starts as `CircularCouetteFlow` and should stay so; U is the speed of the faster wall,
    Re = U (R2 - R1) / nu, rho0 = 1000 kg/m^3. The forces and torques on `inner` and `outer` are
    recorded; `CircularCouetteFlow(inner, outer).torque(nu)` is the exact one on the inner cylinder.

    Args:
        resolution: particles to the inner radius; overrides the scale's, time step scaled along.
        reynolds: Reynolds number.
        inner, outer: turns of the cylinders [rad/s], counterclockwise; one at least is not zero.
        ghosts: in `rows` along the cylinders, or on the `lattice`, which makes stairs of them.
        scale: `small` (12 to the radius), `half` (24) or `paper` (48).
        h_over_dx: smoothing length over spacing; overrides the scale's.
        time_step: dt [s]; overrides the scale's.
        end_time: [s].
        layers: of ghosts; a full support's if none is given.
        wall_velocity: how viscosity sees the walls; the scheme's own no-slip if none is given.
        arrangement: how particles start; the lattice if none is given.
        kernel: Wendland C2 if none is given.
        mach: Mach number U / c0.
        scheme: of `jaxsph.schemes`; `SharpAtWalls()` if none is given.
        dtype: float64 or float32; JAX's default if none is given.

    Raises:
        ValueError: if nothing turns, or for a Reynolds number, resolution or step out of range.
    """
    positive(reynolds=reynolds, mach=mach, **{"t-end": end_time})
    if inner == 0.0 and outer == 0.0:
        raise ValueError("inner, outer: no cylinder turns; give one of them a turn in rad/s.")
    scheme = SharpAtWalls() if scheme is None else scheme
    fast = max(abs(inner) * INNER, abs(outer) * OUTER)
    viscosity = fast * (OUTER - INNER) / reynolds

    def longest_step(scale):
        h = scale.h_over_dx * INNER / scale.resolution
        return min(0.9 * VISCOUS_LIMIT * h**2 / viscosity, 0.5 * h * mach / fast)

    core, around = (BallRegion((0.0, 0.0), radius) for radius in (INNER, OUTER))
    parts = [WallPart("inner", core), WallPart("outer", ~around)]
    turning = [
        MovingWall(part.region, _Turn(float(turn)))
        for part, turn in zip(parts, (inner, outer), strict=True)
        if turn
    ]
    flow, region = CircularCouetteFlow(float(inner), float(outer)), around & ~core
    return composed(
        "taylor-couette",
        effects=scheme.effects(viscosity, None, region, wall_velocity),
        box=Box((-HALF, -HALF), (HALF, HALF), (False, False)),
        scale=pick_scale(SCALES, scale).with_overrides(
            end_time, resolution, h_over_dx, time_step, longest_step
        ),
        end_time=end_time,
        reference_density=REFERENCE_DENSITY,
        reference_speed=fast,
        mach=mach,
        side=INNER,
        region=region,
        walls=lambda space: Walls.around(
            region, space, turning, layers, parts=parts,
            in_rows=in_rows(ghosts, [part.region for part in parts]),
        ),
        velocity=lambda x: flow(x, 0.0)[0],
        pressure=lambda x: flow(x, 0.0)[1],
        arrangement=Lattice() if arrangement is None else arrangement,
        kernel=kernel,
        dtype=dtype,
        solution=flow if wall_velocity is None else None,
        parameters={
            "scale": scale,
            "reynolds": reynolds,
            "inner": inner,
            "outer": outer,
            "ghosts": ghosts,
            "layers": layers,
            "wall_velocity": None if wall_velocity is None else record(wall_velocity),
            "scheme": record(scheme),
        },
    )
