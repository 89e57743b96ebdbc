"""The reduced model whose rates are evaluated at a few points, in the protocol of the loop."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsph.integrate import Fault, FaultCode, Model

from ..basis import Basis
from .eulerian_rates import EulerianRates
from .sampling import Samples


class SampledModel(Model):
    """da/dt = B f-bar_P(centre + Phi a, t; nu); its state are the coordinates a (M,).

    f-bar is evaluated as it stands, on the samples P and the points around these: terms need not be
    polynomial, and forces may change with time. The cost is that of a full right-hand side on
    these points, whatever the number of all points. `TensorModel` is far faster where the
    equations are quadratic.

    Args:
        rates_around: f-bar on the samples, which come first, and on the points around them.
        modes: Phi there (U, F, M).
        centre: state there about which the modes are taken (U or 1, F).
        gather: B (M, P, F).
        viscosity: nu [m^2/s], a leaf to sweep or to differentiate.
    """

    rates_around: EulerianRates
    modes: Float[Array, "members fields modes"]
    centre: Float[Array, "#members fields"]
    gather: Float[Array, "modes samples fields"]
    viscosity: Float[Array, ""] = eqx.field(converter=jnp.asarray)

    @classmethod
    def of_samples(
        cls, rates: EulerianRates, basis: Basis, samples: Samples, viscosity: Float[Array, ""]
    ) -> SampledModel:
        """The model on the samples' surroundings.

        Args:
            rates: on all points.
            basis: of (r, u), r the logarithmic density, on all points.
            samples: as a `Sampling` chose them.
            viscosity: nu [m^2/s].

        Raises:
            ValueError: as `EulerianRates.around`.
        """
        around, members = rates.around(samples.points)
        dtype = rates.points.dtype
        modes, centre, gather = (
            jnp.asarray(a, dtype)
            for a in (basis.modes[members], _rows(basis.centre, members), samples.gather)
        )
        return cls(around, modes, centre, gather, jnp.asarray(viscosity, dtype))

    def prepare(self, state):
        return None

    def refresh(self, auxiliary, state, time_step):
        return auxiliary

    def rates(self, time, state, auxiliary):
        fields = self.centre + self.modes @ state
        found = self.rates_around(time, fields, self.viscosity)
        return jnp.einsum("mpf,pf->m", self.gather, found[: self.gather.shape[1]])

    def finish(self, state):
        return state

    def inspect(self, step, state, auxiliary):
        lost = ~jnp.all(jnp.isfinite(state))
        return Fault.first_of(step, (FaultCode.NOT_FINITE, lost, -1))

    def observe(self, state):
        return state


def _rows(centre, members):
    """A centre at some points; a single row is that of all."""
    return centre if len(centre) == 1 else centre[members]
