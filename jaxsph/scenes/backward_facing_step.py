"""A channel that widens at once: flow over a backward-facing step."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np

from ..arrangements import Arrangement
from ..effects import ParabolicProfile
from ..kernels import Kernel
from ..schemes import Scheme, SharpAtWalls
from ..walls import BoxRegion
from .composed import pick_scale, positive
from .ends import named_ends
from .flow_through import flow_through
from .scales import Scale
from .scene import Scene

STEP, HEIGHT, MEAN = 1.0, 1.0, 1.0  # m, m, m/s
FRINGE = 2.0  # m
# mean reattachment lengths over the step's height, Erturk (2008), expansion ratio 2
REATTACHMENT = {100.0: 2.922, 200.0: 4.982}
SCALES = {
    "small": Scale(resolution=10, h_over_dx=1.5, time_step=1e-2, steps_per_snapshot=50),
    "half": Scale(resolution=20, h_over_dx=1.5, time_step=5e-3, steps_per_snapshot=100),
    "paper": Scale(resolution=40, h_over_dx=1.5, time_step=2.5e-3, steps_per_snapshot=200),
}


def backward_facing_step(
    resolution: int | None = None,
    reynolds: float = 100.0,
    *,
    upstream: float = 2.0,
    downstream: float = 10.0,
    ends: str = "fringe",
    scale: str = "small",
    h_over_dx: float | None = None,
    time_step: float | None = None,
    end_time: float = 40.0,
    layers: int | None = None,
    arrangement: Arrangement | None = None,
    kernel: Kernel | None = None,
    scheme: Scheme | None = None,
    mach: float = 0.1,
    dtype=None,
) -> Scene:
    """Flow from a channel 1 m high over a step of 1 m down into one of 2 m.

    A parabola of mean U = 1 m/s flows in between y = 0 and 1 m; Re = U D / nu with D = 2 m, twice
    the channel's height (Armaly et al. 1983), rho0 = 1 kg/m^3. The flow comes back to the lower
    wall, y = -1 m, 2.922 and 4.982 m behind the step at Re = 100 and 200 (Erturk 2008). Behind the
    wide channel one as at the inflow is the fringe, which makes what flows out into what flows in;
    `downstream` should be twice the way to reattachment. It starts with the inflow in the upper
    half and rest in the lower.

    Args:
        resolution: particles over the step's height; overrides the scale's, time step scaled along.
        reynolds: Reynolds number of mean speed and twice the channel's height.
        upstream: from the inflow to the step [m], rounded to whole spacings.
        downstream: length of the wide channel [m], its end rounded likewise.
        ends: `fringe` or `openings`; what lies beyond the channel.
        scale: `small` (10 over the step), `half` (20) or `paper` (40).
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
        ValueError: for a Reynolds number, a length, a resolution or a step out of range.
    """
    positive(reynolds=reynolds, **{"t-end": end_time})
    for name, value in {"upstream": upstream, "downstream": downstream}.items():
        if not STEP <= value < np.inf:
            raise ValueError(f"{name}: at least {STEP:g} m and finite, got {value:g}.")
    scale_of = pick_scale(SCALES, scale).with_overrides(end_time, resolution, h_over_dx, time_step)
    narrow = BoxRegion((-np.inf, 0.0), (np.inf, HEIGHT))
    rows = scale_of.resolution / STEP  # both faces lie between columns of particles
    face, end = (round(x * rows) / rows for x in (upstream, upstream + downstream))
    inflow = ParabolicProfile(jnp.asarray(1.5 * MEAN), HEIGHT)

    def start(position):
        return jnp.maximum(inflow(position, jnp.zeros((), position.dtype)), 0.0)

    return flow_through(
        "backward-facing-step",
        length=end,
        ends=named_ends(ends, FRINGE),
        across=(-STEP, HEIGHT),
        region=narrow | BoxRegion((face, -STEP), (end if ends == "fringe" else np.inf, HEIGHT)),
        side=STEP,
        speed=1.5 * MEAN,
        inflow=inflow,
        start=start,
        scale=scale_of,
        end_time=end_time,
        viscosity=MEAN * 2.0 * HEIGHT / reynolds,
        mach=mach,
        layers=layers,
        arrangement=arrangement,
        kernel=kernel,
        scheme=SharpAtWalls() if scheme is None else scheme,
        dtype=dtype,
        parameters={
            "ends": ends,
            "scale": scale,
            "reynolds": reynolds,
            "upstream": upstream,
            "downstream": downstream,
        },
    )
