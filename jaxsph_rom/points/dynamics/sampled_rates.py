"""Rates that are evaluated at a few points, whatever they are."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...basis import Basis
from .base import Closable
from .eulerian_rates import EulerianRates
from .sampling import Chosen


class SampledRates(Closable):
    """da/dt = B f-bar_P(centre + Phi a, t; theta) + (A + sum_k theta_k A_k) a.

    f-bar is evaluated as it stands, on the samples P and the points around these: terms need not be
    polynomial, and forces may change with time. The cost is that of a full right-hand side on
    these points, whatever the number of all points. `QuadraticSystem` is far faster where the
    equations are quadratic.

    Args:
        rates_around: f-bar on the samples, which come first, and on the points around them.
        modes: Phi there (U, F, M).
        centre: state there about which the modes are taken (U or 1, F).
        gather: B (M, P, F).
        linear: A and A_k of a closure; zero without one.
    """

    rates_around: EulerianRates
    modes: Float[Array, "members fields modes"]
    centre: Float[Array, "#members fields"]
    gather: Float[Array, "modes samples fields"]
    linear: Float[Array, "monomials modes modes"]

    @classmethod
    def of_samples(cls, rates: EulerianRates, basis: Basis, samples: Chosen) -> SampledRates:
        """The rates on the samples' surroundings.

        Args:
            rates: on all points.
            basis: of (r, u), r the logarithmic density, on all points.
            samples: as a `Sampling` chose them.

        Raises:
            ValueError: as `EulerianRates.around`.
        """
        around, members = rates.around(samples.points)
        dtype = rates.points.dtype
        modes, centre, gather = (
            jnp.asarray(a, dtype)
            for a in (
                basis.modes[members], _rows(np.asarray(basis.centre), members), samples.gather
            )
        )  # fmt: skip
        size, count = basis.size, rates.coefficients.size
        return cls(around, modes, centre, gather, jnp.zeros((1 + count, size, size), dtype))

    @property
    def size(self) -> int:
        return self.modes.shape[2]

    def rates(self, time, coordinates, values):
        values = jnp.atleast_1d(jnp.asarray(values, coordinates.dtype))
        fields = self.centre + self.modes @ coordinates
        found = self.rates_around(time, fields, values)
        gathered = jnp.einsum("mpf,pf->m", self.gather, found[: self.gather.shape[1]])
        closure = self.linear[0] + jnp.tensordot(values, self.linear[1:], 1)
        return gathered + closure @ coordinates

    def plus(self, first, others):
        change = jnp.concatenate([first[None], others])
        return eqx.tree_at(lambda s: s.linear, self, self.linear + change)


def _rows(centre, members):
    """A centre at some points; a single row is that of all."""
    return centre if len(centre) == 1 else centre[members]
