"""How far to trust a reduced model where no full run is known."""

from __future__ import annotations

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from jaxsph.compiled import full_precision

from ...basis import Basis
from ..dynamics.base import Dynamics
from ..dynamics.eulerian_rates import EulerianRates
from .calibration import Calibration
from .recovery import Recovery
from .reduced_flow import ReducedFlow

_POINTS = 64  # at which the residual is taken
_TIMES = 4


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

        e(p) = s(p) R / U,    R^2 = mean over times and points of |du/dt - f_u(w, t; theta)|^2,

    w the run's fields, du/dt their change in the run, f the functional as it stands, taken at some
    points and times, U^2 the largest mean over these points of |u|^2 at any of the times. The scale
    s(p) [s] makes it a relative error of velocity: what leaving one training run out after the
    other has shown (`Calibration`). Of a model with a closure it is what its own runs show, times
    by how much leaving one out has raised errors without closure.

    Args:
        rates: on the points, which come first, and on those around them.
        functions: of the fields at these (U, functions).
        count: of the points (static).
        scale: s(p) [s].
    """

    rates: EulerianRates
    functions: Float[Array, "members functions"]
    count: int = eqx.field(static=True)
    scale: Calibration

    @classmethod
    def of(cls, flow: ReducedFlow, places: Places, scale: Calibration) -> Indicator:
        """The indicator of a flow at some of its points."""
        dtype = flow.reference.points.dtype
        functions = jnp.asarray(flow.functions[places.members], dtype)
        scale = jax.tree.map(lambda a: jnp.asarray(a, dtype), scale)
        return cls(places.rates, functions, places.count, scale)

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

    def __call__(self, system, shown, point, values, time, coordinates) -> Float[Array, ""]:
        """The expected error of velocity, relative to the largest velocity in its norm."""
        return self.scale(point) * self.residual(system, shown, values, time, coordinates)


def indicated(
    indicator: Indicator,
    flow: ReducedFlow,
    points: Float[Array, "members names"],
    values: Float[Array, "members coefficients"],
    time: Float[Array, " times"],
    coordinates: Float[Array, "members times modes"],
) -> Float[Array, " members"]:
    """The expected error of each member."""
    return _indicated(indicator, flow.system, flow.shown, points, values, time, coordinates)


@eqx.filter_jit
@full_precision
def _indicated(indicator, system, shown, points, values, time, coordinates):
    def one(member):
        point, values, coordinates = member
        return indicator(system, shown, point, values, time, coordinates)

    return jax.lax.map(one, (points, values, coordinates))


def velocity_error(
    flow: ReducedFlow,
    coordinates: Float[np.ndarray, "times modes"],
    velocity: Float[np.ndarray, "points dim times"],
) -> float:
    """A reduced run's error of velocity over all points and times,

        (<|u - u~|^2>)^(1/2) / max_t (<|u|^2>)^(1/2),

    <> the mean over points, above over times as well.

    Args:
        flow: of the run.
        coordinates: of the run, from its start on.
        velocity: of the full run on the flow's reference points at the same times [m/s].
    """
    found = np.asarray(flow.fields(jnp.asarray(coordinates), np.arange(len(coordinates))).velocity)
    wanted = np.moveaxis(velocity, -1, 0)
    largest = np.sqrt(np.mean(np.sum(wanted**2, axis=2), axis=1)).max(initial=0.0)
    error = np.sqrt(np.mean(np.sum((found - wanted) ** 2, axis=2)))
    return float(error / largest) if largest > 0.0 else float(error)
