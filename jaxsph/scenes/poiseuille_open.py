"""Poiseuille flow in at one end of a channel and out at the other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import jax.numpy as jnp
import numpy as np

from ..arrangements import Arrangement, JitteredLattice
from ..kernels import Kernel
from ..schemes import Scheme
from .composed import pick_scale, positive
from .ends import named_ends
from .open_channel import open_channel
from .scales import Scale
from .scene import Scene

LENGTH, FRINGE, HEIGHT, MEAN = 2.0, 1.0, 1.0, 2.0 / 3.0  # m, m, m, m/s
SCALES = {
    "small": Scale(resolution=20, h_over_dx=2.0, time_step=5e-3, steps_per_snapshot=40),
    "half": Scale(resolution=40, h_over_dx=2.0, time_step=2.5e-3, steps_per_snapshot=80),
    "paper": Scale(resolution=80, h_over_dx=2.0, time_step=1e-3, steps_per_snapshot=200),
}


def _plug(position):
    """The inflow's mean everywhere."""
    return jnp.zeros_like(position).at[:, 0].set(MEAN)


@final
@dataclass(frozen=True)
class OpenPoiseuilleFlow:
    """u = 4 U y (1 - y), p = 8 nu rho0 U (L / 2 - x) in the channel, U = H = 1, as velocity (N, 2)
    [m/s] and pressure (N,) [Pa] at positions (N, 2) [m]; the pressure is no one's in the fringe.

    Args:
        viscosity: nu [m^2/s].
    """

    viscosity: float

    def __call__(self, position, time):
        x, y = np.asarray(position).T
        speed = 4.0 * y * (1.0 - y)
        pressure = 8.0 * self.viscosity * (0.5 * LENGTH - x)
        return np.stack([speed, 0.0 * y], axis=1), pressure


def poiseuille_open(
    resolution: int | None = None,
    reynolds: float = 10.0,
    *,
    ends: str = "fringe",
    scale: str = "small",
    h_over_dx: float | None = None,
    time_step: float | None = None,
    end_time: float = 4.0,
    layers: int | None = None,
    arrangement: Arrangement | None = None,
    kernel: Kernel | None = None,
    scheme: Scheme | None = None,
    mach: float = 0.05,
    dtype=None,
) -> Scene:
    """Poiseuille flow through a channel 2 m long and 1 m high that is open at both ends.

    A parabola of peak U = 1 m/s flows in; Re = U H / nu, rho0 = 1 kg/m^3. Behind the channel
    a fringe 1 m long makes what flows out into what flows in. It starts as a plug, the inflow's
    mean speed everywhere; `exact` is the steady flow, which it has come to within a few seconds.
    The fluid's compressibility, Mach^2 8 L / (Re H) from end to end, is the least error.

    Args:
        resolution: particles across; overrides the scale's, time step scaled along.
        reynolds: Reynolds number.
        ends: `fringe` or `openings`; what lies beyond the channel.
        scale: `small` (20 across), `half` (40) or `paper` (80).
        h_over_dx: smoothing length over spacing; overrides the scale's.
        time_step: dt [s]; overrides the scale's.
        end_time: [s].
        layers: of ghosts; a full support's if none is given.
        arrangement: how particles start; a jittered lattice if none is given.
        kernel: Wendland C2 if none is given.
        scheme: of `jaxsph.schemes`; `Consistent()` if none is given.
        mach: Mach number U / c0.
        dtype: float64 or float32; JAX's default if none is given.

    Raises:
        ValueError: for a Reynolds number, resolution or step out of range.
    """
    positive(reynolds=reynolds, **{"t-end": end_time})
    return open_channel(
        "poiseuille-open",
        length=LENGTH,
        ends=named_ends(ends, FRINGE),
        height=HEIGHT,
        mean_speed=MEAN,
        start=_plug,
        scale=pick_scale(SCALES, scale).with_overrides(end_time, resolution, h_over_dx, time_step),
        end_time=end_time,
        viscosity=1.0 / reynolds,
        mach=mach,
        layers=layers,
        arrangement=JitteredLattice(amplitude=0.25) if arrangement is None else arrangement,
        kernel=kernel,
        scheme=scheme,
        dtype=dtype,
        solution=OpenPoiseuilleFlow(1.0 / reynolds),
        parameters={"ends": ends, "scale": scale, "reynolds": reynolds},
    )
