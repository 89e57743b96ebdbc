"""A cylinder in a channel, the benchmark 2D-1 of Schaefer and Turek (1996)."""

from __future__ import annotations

from ..arrangements import Arrangement
from ..kernels import Kernel
from ..schemes import Scheme, SharpAtWalls
from ..walls import BallRegion, WallPart
from .composed import in_rows, pick_scale, positive
from .ends import named_ends
from .open_channel import open_channel
from .scales import Scale
from .scene import Scene

LENGTH, FRINGE, HEIGHT = 2.2, 0.4, 0.41  # m
MEAN, DIAMETER = 0.2, 0.1  # m/s, m
CYLINDER = BallRegion((0.2, 0.2), 0.5 * DIAMETER)
# a cylinder is thick enough from 33 particles across on at h = 2 dx, from 25 at 1.5 dx
SCALES = {
    "small": Scale(resolution=41, h_over_dx=1.5, time_step=6e-3, steps_per_snapshot=20),
    "half": Scale(resolution=82, h_over_dx=1.5, time_step=3e-3, steps_per_snapshot=40),
    "paper": Scale(resolution=164, h_over_dx=1.5, time_step=1.5e-3, steps_per_snapshot=80),
}


def channel_cylinder(
    resolution: int | None = None,
    reynolds: float = 20.0,
    *,
    ends: str = "fringe",
    ghosts: str = "rows",
    scale: str = "small",
    h_over_dx: float | None = None,
    time_step: float | None = None,
    end_time: float = 6.0,
    layers: int | None = None,
    arrangement: Arrangement | None = None,
    kernel: Kernel | None = None,
    scheme: Scheme | None = None,
    mach: float = 0.1,
    dtype=None,
) -> Scene:
    """Flow past a cylinder of 0.1 m at (0.2, 0.2) m in a channel 2.2 m long and 0.41 m high.

    A parabola of mean U = 0.2 m/s flows in; Re = U D / nu, rho0 = 1 kg/m^3; the wall's part
    `cylinder` has its force recorded, with coefficients of U and D. At Re = 20 drag is 5.57 to 5.59
    and lift 0.0104 to 0.0110 (Schaefer and Turek 1996). Behind the channel a fringe 0.4 m
    long makes what flows out into what flows in. It starts with the inflow's velocity everywhere.

    Args:
        resolution: particles across; overrides the scale's, time step scaled along.
        reynolds: Reynolds number of mean speed and diameter.
        ends: `fringe` or `openings`; what lies beyond the channel.
        ghosts: in `rows` along the cylinder, or on the `lattice`, which makes stairs of it.
        scale: `small` (41 across), `half` (82) or `paper` (164).
        h_over_dx: smoothing length over spacing; overrides the scale's.
        time_step: dt [s]; overrides the scale's.
        end_time: [s].
        layers: of ghosts; a full support's if none is given.
        arrangement: how particles start; the lattice if none is given.
        kernel: Wendland C2 if none is given.
        scheme: of `jaxsph.schemes`; `SharpAtWalls()` if none is given.
        mach: Mach number of the inflow's peak, 1.5 U / c0.
        dtype: float64 or float32; JAX's default if none is given.

    Raises:
        ValueError: for a Reynolds number, resolution or step out of range.
    """
    positive(reynolds=reynolds, **{"t-end": end_time})
    return open_channel(
        "channel-cylinder",
        length=LENGTH,
        ends=named_ends(ends, FRINGE),
        height=HEIGHT,
        mean_speed=MEAN,
        obstacle=CYLINDER,
        in_rows=in_rows(ghosts, [CYLINDER]),
        parts=[WallPart("cylinder", CYLINDER, reference_length=DIAMETER, reference_speed=MEAN)],
        scale=pick_scale(SCALES, scale).with_overrides(end_time, resolution, h_over_dx, time_step),
        end_time=end_time,
        viscosity=MEAN * DIAMETER / reynolds,
        mach=mach,
        layers=layers,
        arrangement=arrangement,
        kernel=kernel,
        scheme=SharpAtWalls() if scheme is None else scheme,
        dtype=dtype,
        parameters={"ends": ends, "ghosts": ghosts, "scale": scale, "reynolds": reynolds},
    )
