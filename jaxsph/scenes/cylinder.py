"""A cylinder in a uniform stream, and its wake."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np

from ..arrangements import Arrangement
from ..effects import UniformProfile
from ..kernels import Kernel
from ..schemes import Scheme, SharpAtWalls
from ..walls import BallRegion, WallPart
from .composed import in_rows, pick_scale, positive
from .ends import named_ends
from .flow_through import flow_through
from .scales import Scale
from .scene import Scene

DIAMETER, SPEED = 1.0, 1.0  # m, m/s
FRINGE = 3.0  # m
KICK = 0.3  # of the speed: across the stream behind the cylinder, at the start
SCALES = {
    "small": Scale(resolution=10, h_over_dx=1.5, time_step=1.5e-2, steps_per_snapshot=20),
    "half": Scale(resolution=20, h_over_dx=1.5, time_step=7.5e-3, steps_per_snapshot=40),
    "paper": Scale(resolution=30, h_over_dx=1.5, time_step=5e-3, steps_per_snapshot=60),
}


def cylinder(
    resolution: int | None = None,
    reynolds: float = 100.0,
    *,
    upstream: float = 5.0,
    downstream: float = 10.0,
    width: float = 10.0,
    ends: str = "fringe",
    ghosts: str = "lattice",
    scale: str = "small",
    h_over_dx: float | None = None,
    time_step: float | None = None,
    end_time: float = 100.0,
    layers: int | None = None,
    arrangement: Arrangement | None = None,
    kernel: Kernel | None = None,
    scheme: Scheme | None = None,
    mach: float = 0.1,
    dtype=None,
) -> Scene:
    """Flow past a cylinder, one of a row of them that stand side by side.

    U = D = 1 (m/s, m), Re = U D / nu, rho0 = 1 kg/m^3. The stream is uniform at the start and far
    ahead; behind the channel a fringe 3 m long makes what flows out into what flows in, and the box
    is periodic across the stream: `width` is the distance of one cylinder to the next, D / width
    the blockage, which makes drag and frequency greater than those of a single one. Above Re of
    about 47 the wake sheds vortices; a velocity of 0.3 U exp(-r^2 / D^2) across the stream, r the
    distance to a place 1.5 D behind the cylinder, starts it. The wall's part `cylinder` has its
    force recorded, with coefficients of U and D.

    Args:
        resolution: particles a diameter; overrides the scale's, time step scaled along.
        reynolds: Reynolds number of speed and diameter.
        upstream: from the inflow to the cylinder's centre [m].
        downstream: from there to the outflow [m].
        width: of the box across the stream [m].
        ends: `fringe` or `openings`; what lies beyond the channel.
        ghosts: in `rows` along the cylinder, or on the `lattice`, which makes stairs of it; these
            are symmetric, as the cylinder's centre is a corner of lattice cells.
        scale: `small` (10 a diameter), `half` (20) or `paper` (30).
        h_over_dx: smoothing length over spacing; overrides the scale's.
        time_step: dt [s]; overrides the scale's.
        end_time: [s].
        layers: of ghosts; a full support's if none is given.
        arrangement: how particles start; the lattice if none is given.
        kernel: Wendland C2 if none is given.
        scheme: of `jaxsph.schemes`; `SharpAtWalls()` if none is given.
        mach: Mach number U / c0.
        dtype: float64 or float32; JAX's default if none is given.

    Raises:
        ValueError: for a Reynolds number, a length, a resolution or a step out of range.
    """
    positive(reynolds=reynolds, **{"t-end": end_time})
    scale_of = pick_scale(SCALES, scale).with_overrides(end_time, resolution, h_over_dx, time_step)
    for name, value in {"upstream": upstream, "downstream": downstream, "width": width}.items():
        least = DIAMETER if name != "width" else 2.0 * DIAMETER
        if not least <= value < np.inf:
            raise ValueError(f"{name}: at least {least:g} m and finite, got {value:g}.")
    body = BallRegion((upstream, 0.0), 0.5 * DIAMETER)
    wide = DIAMETER * np.ceil(width * scale_of.resolution / DIAMETER - 1e-9) / scale_of.resolution

    def start(position):
        apart = position - jnp.asarray([[upstream + 1.5 * DIAMETER, 0.0]], position.dtype)
        across = KICK * SPEED * jnp.exp(-jnp.sum(apart**2, axis=1) / DIAMETER**2)
        return jnp.stack([jnp.full_like(across, SPEED), across], axis=1)

    return flow_through(
        "cylinder",
        length=upstream + downstream,
        ends=named_ends(ends, FRINGE),
        across=(-0.5 * wide, 0.5 * wide),
        periodic=True,
        region=~body,
        side=DIAMETER,
        speed=SPEED,
        inflow=UniformProfile(jnp.asarray(SPEED)),
        start=start,
        in_rows=in_rows(ghosts, [body]),
        parts=[WallPart("cylinder", body, reference_length=DIAMETER, reference_speed=SPEED)],
        scale=scale_of,
        end_time=end_time,
        viscosity=SPEED * DIAMETER / reynolds,
        mach=mach,
        layers=layers,
        arrangement=arrangement,
        kernel=kernel,
        scheme=SharpAtWalls() if scheme is None else scheme,
        dtype=dtype,
        parameters={
            "ends": ends,
            "ghosts": ghosts,
            "scale": scale,
            "reynolds": reynolds,
            "upstream": upstream,
            "downstream": downstream,
            "width": width,
        },
    )
