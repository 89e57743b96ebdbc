"""Water that sloshes in a tank shaken sideways."""

from __future__ import annotations

import math
from typing import final

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.integrate import solve_ivp

from ..arrangements import Arrangement, Lattice
from ..domain import Box
from ..effects import Gravity, LaminarViscosity, MovingFrame, WettedWalls
from ..kernels import Kernel
from ..record import record
from ..schemes import Consistent, Scheme
from ..walls import BoxRegion, Walls
from .composed import composed, pick_scale, positive
from .scales import Scale
from .scene import Scene

REFERENCE_DENSITY = 1000.0  # kg/m^3
GRAVITY = 9.81  # m/s^2
LENGTH = 0.57  # m, of the tank
DEPTH = 0.15  # m, of the water
TOP = 0.3  # m, of the tank
SPEED = math.sqrt(GRAVITY * DEPTH)  # m/s
SCALES = {
    "small": Scale(resolution=38, h_over_dx=2.0, time_step=3e-3, steps_per_snapshot=10),
    "half": Scale(resolution=76, h_over_dx=2.0, time_step=1.5e-3, steps_per_snapshot=20),
    "paper": Scale(resolution=152, h_over_dx=2.0, time_step=7.5e-4, steps_per_snapshot=40),
}
_MODES = 9  # odd ones, from the first on: the first has all but a few percent of the wave


def natural_frequency(number: int = 1) -> float:
    """w_n [rad/s], w_n^2 = g k_n tanh(k_n H), k_n = n pi / L, of the n-th wave of the tank."""
    wave_number = number * math.pi / LENGTH
    return math.sqrt(GRAVITY * wave_number * math.tanh(wave_number * DEPTH))


@final
class Shaking(eqx.Module):
    """d(t) = A r(t / T) sin(w t) e_x, r = s^3 (10 - 15 s + 6 s^2) in the first period, then 1.

    Acceleration and its rate set out from zero, so that no sound does.

    Args:
        amplitude: A [m].
        frequency: w [rad/s], T = 2 pi / w.
    """

    amplitude: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    frequency: Float[Array, ""] = eqx.field(converter=jnp.asarray)

    def __call__(self, time):
        phase = self.frequency * time
        share = jnp.clip(phase / (2.0 * jnp.pi), 0.0, 1.0)
        ramp = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
        way = self.amplitude * ramp * jnp.sin(phase)
        return jnp.stack([way, jnp.zeros_like(way)])


def linear_elevation(
    x: float,
    time: Float[np.ndarray, " times"],
    amplitude: float,
    frequency: float,
    viscosity: float = 0.0,
) -> Float[np.ndarray, " times"]:
    """Height of the surface over its rest [m] at a gauge by linear theory (Faltinsen 1978):

        eta = sum_n q_n cos(k_n x),    q_n'' + 4 nu k_n^2 q_n' + w_n^2 q_n = c_n d'',
        c_n = 4 L / (n pi)^2 k_n tanh(k_n H),    n = 1, 3, 5, ...,

    from rest, d as `Shaking` has it, transient waves included, the damping that of viscous
    water between walls without friction (Lamb 1932, section 348).

    Args:
        x: of the gauge, from the left wall [m].
        time: [s], increasing, from 0 on.
        amplitude: A [m].
        frequency: w over the tank's first natural frequency.
        viscosity: nu [m^2/s].
    """
    numbers = 1 + 2 * np.arange(_MODES)
    k = numbers * math.pi / LENGTH
    steep = k * np.tanh(k * DEPTH)
    gain = 4.0 * LENGTH / (numbers * math.pi) ** 2 * steep
    shaking = Shaking(amplitude, frequency * natural_frequency())
    dense = np.linspace(0.0, float(time[-1]), 2 + int(200 * float(time[-1]) / _period(frequency)))
    acceleration = jax.jit(jax.vmap(jax.jacfwd(jax.jacfwd(lambda t: shaking(t)[0]))))
    pushed = np.asarray(acceleration(jnp.asarray(dense)))

    def rates(t, q):
        height, speed = q.reshape(2, -1)
        force = gain * np.interp(t, dense, pushed)
        change = force - GRAVITY * steep * height - 4.0 * viscosity * k**2 * speed
        return np.concatenate([speed, change])

    found = solve_ivp(
        rates, (0.0, float(time[-1])), np.zeros(2 * _MODES), t_eval=np.asarray(time), rtol=1e-8,
        atol=1e-8 * amplitude, max_step=_period(frequency) / 50.0,
    )  # fmt: skip
    return np.cos(k * x) @ found.y[:_MODES]


def _period(frequency: float) -> float:
    return 2.0 * math.pi / (frequency * natural_frequency())


def sloshing(
    resolution: int | None = None,
    reynolds: float = 1000.0,
    *,
    amplitude: float = 0.004,
    frequency: float = 0.8,
    scale: str = "small",
    h_over_dx: float | None = None,
    time_step: float | None = None,
    end_time: float = 6.0,
    arrangement: Arrangement | None = None,
    kernel: Kernel | None = None,
    mach: float = 0.1,
    scheme: Scheme | None = None,
    dtype=None,
) -> Scene:
    """Water 0.15 m deep in a tank 0.57 m long that is shaken sideways, in the tank's frame.

    The tank of Liu and Lin (2008), moved as `Shaking` says from rest on. rho0 = 1000 kg/m^3,
    g = 9.81 m/s^2, U = (g H)^(1/2), Re = U H / nu; walls have no friction. `linear_elevation` is
    what a wave gauge (`jaxsph.metrics.surface_height`) should see.

    Args:
        resolution: particles along the tank; overrides the scale's, time step scaled along.
        reynolds: Reynolds number.
        amplitude: A of the tank [m].
        frequency: w of the tank over its water's first natural frequency, 6.06 rad/s.
        scale: `small` (38), `half` (76) or `paper` (152 particles along it).
        h_over_dx: smoothing length over spacing; overrides the scale's.
        time_step: dt [s]; overrides the scale's.
        end_time: [s].
        arrangement: how particles start; the lattice if none is given.
        kernel: Wendland C2 if none is given.
        mach: Mach number U / c0.
        scheme: of `jaxsph.schemes`; `Consistent()` if none is given.
        dtype: float64 or float32; JAX's default if none is given.

    Raises:
        ValueError: for an amplitude, a frequency, a resolution or a step out of range.
    """
    scheme = Consistent() if scheme is None else scheme
    positive(
        reynolds=reynolds, amplitude=amplitude, frequency=frequency, **{"t-end": end_time}
    )
    if amplitude > 0.2 * DEPTH:
        raise ValueError(
            f"amplitude: at most {0.2 * DEPTH:g} m, or waves break; got {amplitude:g} m."
        )
    tank = BoxRegion((0.0, 0.0), (LENGTH, TOP))
    shaking = Shaking(amplitude, frequency * natural_frequency())
    effects = scheme.free_surface_effects(
        LaminarViscosity(jnp.asarray(SPEED * DEPTH / reynolds)),
        MovingFrame(shaking),
        force=Gravity(jnp.asarray([0.0, -GRAVITY])),
        vessel=tank,
    )

    return composed(
        "sloshing",
        effects=(*effects, WettedWalls()),
        box=Box((0.0, 0.0), (LENGTH, TOP), (False, False)),
        scale=pick_scale(SCALES, scale).with_overrides(end_time, resolution, h_over_dx, time_step),
        end_time=end_time,
        reference_density=REFERENCE_DENSITY,
        reference_speed=SPEED,
        mach=mach,
        side=LENGTH,
        region=BoxRegion((0.0, 0.0), (LENGTH, DEPTH)),
        walls=lambda space: Walls.around(tank, space),
        pressure=lambda x: REFERENCE_DENSITY * GRAVITY * (DEPTH - x[:, 1]),
        arrangement=Lattice() if arrangement is None else arrangement,
        kernel=kernel,
        dtype=dtype,
        parameters={
            "scale": scale,
            "reynolds": reynolds,
            "amplitude": amplitude,
            "frequency": frequency,
            "scheme": record(scheme),
        },
    )
