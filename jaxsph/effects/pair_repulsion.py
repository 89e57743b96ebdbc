"""A short-range repulsion between particles, against pairs that run into one another."""

from dataclasses import dataclass

import jax.numpy as jnp

from ..pairs import PairTerm
from .base import Effect

_RANGE = 0.4  # times dx; evenly spread particles stay farther apart
_STRENGTH = 4.0 / 9.0  # four times this and RK4 steps at the sound's limit would feed every contact


@dataclass(frozen=True)
class Closeness:
    """(1 - r^2 / a^2) (x_j - x_i) where r < a"""

    reach: float

    def __call__(self, pair, i, j):
        close = 1.0 - pair.squared_distance * (1.0 / self.reach**2)
        return pair.separation * jnp.maximum(close, 0.0)


class PairRepulsion(Effect):
    """du_i/dt = -A (c0 / h)^2 sum_j (1 - r^2 / a^2) (x_j - x_i) over neighbours with r < a:

    a = 0.4 dx, A = 4/9. A kernel's gradient vanishes at r = 0, so pressure lets two particles fall
    into one place where the kernel is wide, a jet thin or viscosity low; such a pair moves as one
    particle of twice the mass ever after. The force has a potential, so it makes no energy, and it
    conserves momentum; among evenly spread particles it is zero. It stops a pair that approaches
    with up to a A^(1/2) c0 / h, 0.13 c0 at h = 2 dx. A contact is over within a few steps, whatever
    h / dx: at the longest, 1.5 h / c0, pairs leave it with less energy than they came with on the
    average, single ones with up to half as much again.
    """

    def on_fixed_points(self):
        return ()  # points lie evenly

    def rate_terms(self, context):
        return (PairTerm("closeness", (), Closeness(_RANGE * context.space.spacing)),)

    def rates(self, context, fields, sums):
        strength = _STRENGTH * (context.fluid.sound_speed / context.space.smoothing_length) ** 2
        return {"velocity": -strength * sums["closeness"]}
