"""How far to trust a reduced model where no full run is known."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ...basis import Basis
from ..dynamics.base import Dynamics
from ..dynamics.eulerian_rates import EulerianRates
from .recovery import Recovery
from .reduced_flow import ReducedFlow

_POINTS = 64  # at which the residual is taken
_TIMES = 4
_LEAST = 1e-12  # of a residual


class Places(NamedTuple):
    """Where residuals are taken.

    Args:
        rates: on these points, which come first, and on those around them.
        members: numbers of all of these.
        count: of the points.
    """

    rates: EulerianRates
    members: Int[np.ndarray, " members"]
    count: int

    @classmethod
    def among(cls, rates: EulerianRates) -> Places:
        """Some of the points of rates, evenly spread over their numbers."""
        points = len(rates.points)
        samples = np.unique(np.linspace(0, points - 1, min(_POINTS, points)).astype(int))
        return cls(*rates.around(samples), len(samples))


class Indicator(eqx.Module):
    """The residual of the fluid's momentum equation in a reduced run, as an error:

        e(theta) = s R / U,    R^2 = mean over times and points of |du/dt - f_u(w, t; theta)|^2,

    w the run's fields, du/dt their change in the run, f the functional as it stands, taken at some
    points and times, U^2 the largest mean over these points of |u|^2 at any of the times. The scale
    s [s] makes it a relative error of velocity: what leaving one training run out after the other
    has shown, in the geometric mean. Of a model with a closure it
    is what its own runs show, times by how much leaving one out has raised errors without closure.

    Args:
        rates: on the points, which come first, and on those around them.
        functions: of the fields at these (U, functions).
        count: of the points (static).
        scale: s [s].
    """

    rates: EulerianRates
    functions: Float[Array, "members functions"]
    count: int = eqx.field(static=True)
    scale: Float[Array, ""]

    @classmethod
    def of(cls, flow: ReducedFlow, places: Places, scale: float) -> Indicator:
        """The indicator of a flow at some of its points."""
        dtype = flow.reference.points.dtype
        functions = jnp.asarray(flow.functions[places.members], dtype)
        return cls(places.rates, functions, places.count, jnp.asarray(scale, dtype))

    def residual(
        self,
        system: Dynamics,
        shown: Basis | Recovery,
        values: Float[Array, " coefficients"],
        time: Float[Array, " times"],
        coordinates: Float[Array, "times modes"],
    ) -> Float[Array, ""]:
        """R / U of one run [1/s]; not finite if the run is lost."""
        places = np.unique(np.linspace(0, len(time) - 1, 1 + _TIMES).astype(int))
        values = jnp.asarray(values, coordinates.dtype)

        def squares(moment):
            t, a = moment

            def made(a):
                matrix, rest = shown.combination(a)
                return self.functions @ matrix + rest

            fields, change = jax.jvp(made, (a,), (system.rates(t, a, values),))
            away = change - self.rates(t, fields, values)
            parts = away[: self.count, 1:], fields[: self.count, 1:]
            return tuple(jnp.mean(jnp.sum(part**2, axis=1)) for part in parts)

        moments = jnp.asarray(time, coordinates.dtype)[places], coordinates[places]
        away, speed = jax.lax.map(squares, moments)
        largest = jnp.max(speed)
        # the start is the family's own: what it lacks is no residual of the run
        residual = jnp.mean(away[-_TIMES:]) / jnp.where(largest > 0.0, largest, 1.0)
        return jnp.sqrt(residual)

    def __call__(self, system, shown, values, time, coordinates) -> Float[Array, ""]:
        """The expected error of velocity, relative to the largest velocity in its norm."""
        return self.scale * self.residual(system, shown, values, time, coordinates)


def indicated(
    indicator: Indicator,
    flow: ReducedFlow,
    values: Float[Array, "members coefficients"],
    time: Float[Array, " times"],
    coordinates: Float[Array, "members times modes"],
) -> Float[Array, " members"]:
    """The expected error of each member."""
    return _indicated(indicator, flow.system, flow.shown, values, time, coordinates)


@eqx.filter_jit
def _indicated(indicator, system, shown, values, time, coordinates):
    def one(member):
        values, coordinates = member
        return indicator(system, shown, values, time, coordinates)

    return jax.lax.map(one, (values, coordinates))


def velocity_error(
    flow: ReducedFlow,
    coordinates: Float[np.ndarray, "times modes"],
    velocity: Float[np.ndarray, "points dim times"],
) -> float:
    """Root mean square over points and times of a run's error of velocity, relative to that of the
    largest velocity field."""
    found = np.asarray(flow.fields(jnp.asarray(coordinates), np.arange(len(coordinates))).velocity)
    wanted = np.moveaxis(velocity, -1, 0)
    largest = np.sqrt(np.mean(np.sum(wanted**2, axis=2), axis=1)).max(initial=0.0)
    error = np.sqrt(np.mean(np.sum((found - wanted) ** 2, axis=2)))
    return float(error / largest) if largest > 0.0 else float(error)


def scale_of(errors: Sequence[float], residuals: Sequence[float]) -> float:
    """s [s]: errors over residuals in the geometric mean, of runs that were not lost."""
    pairs = np.asarray([(e, max(r, _LEAST)) for e, r in zip(errors, residuals, strict=True)])
    good = np.isfinite(pairs).all(axis=1) & (pairs[:, :1] > 0.0).all(axis=1)
    if not good.any():
        return float("nan")
    return float(np.exp(np.mean(np.log(pairs[good, 0] / pairs[good, 1]))))
