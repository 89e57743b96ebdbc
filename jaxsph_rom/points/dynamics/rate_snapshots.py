"""Rates along training runs, as modes: what samples are chosen by."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from jaxsph import Fluid
from jaxsph.compiled import full_precision

from ...basis import Basis, InnerProduct, Uncentred, pod
from .eulerian_rates import EulerianRates

_SMALLEST = 1e-7  # of the largest singular value


class VisitedStates(NamedTuple):
    """States in reduced coordinates that a run passes through.

    Args:
        values: theta of the run; a viscosity [m^2/s], say.
        time: when [s] (S,).
        coordinates: of these states (S, M).
    """

    values: float | Float[np.ndarray, " coefficients"]
    time: Float[np.ndarray, " states"]
    coordinates: Float[np.ndarray, "states modes"]


class _OfRates(InnerProduct):
    """The product of a basis."""

    factors: Float[np.ndarray, " fields"]

    def weights(self, fluid, dim):
        return self.factors

    @property
    def centring(self):
        return Uncentred()


def rate_basis(rates: EulerianRates, basis: Basis, visited: Sequence[VisitedStates]) -> Basis:
    """POD of the rates at the states visited, in the inner product of their basis, about zero.

    Each state gives a snapshot of what each coefficient adds, and one of the rest: where rates are
    affine in these, those at any other coefficients are in the span.

    Args:
        rates: on all reference points.
        basis: of (r, u), r the logarithmic density.
        visited: by the training runs, in the coordinates of the basis. The reduced model meets its
            own states only, so take projections, not the full states.

    Raises:
        ValueError: if no state is given.
    """
    if not visited or not all(len(states.time) for states in visited):
        raise ValueError("visited: no state is given; project the training runs' snapshots.")
    dtype = rates.points.dtype
    modes, centre = jnp.asarray(basis.modes, dtype), jnp.asarray(basis.centre, dtype)
    found = [
        _parts(
            rates,
            modes,
            centre,
            jnp.atleast_1d(jnp.asarray(states.values, dtype)),
            jnp.asarray(states.time, dtype),
            jnp.asarray(states.coordinates, dtype),
        )
        for states in visited
    ]
    snapshots = np.concatenate([np.asarray(part) for parts in found for part in parts])
    return rate_modes(np.moveaxis(snapshots, 0, -1), basis.weights, rates.functional.fluid)


def rate_modes(
    snapshots: Float[np.ndarray, "points fields snapshots"],
    weights: Float[np.ndarray, " fields"],
    fluid: Fluid,
) -> Basis:
    """POD of rates about zero, in the product with these weights, without what is round-off."""
    whole = pod(snapshots, _OfRates(np.asarray(weights)), fluid)
    sigma = whole.singular_values
    return whole.truncated(int(np.count_nonzero(sigma > _SMALLEST * sigma[0])))


@eqx.filter_jit
@full_precision
def _parts(rates, modes, centre, values, time, coordinates) -> tuple[Array, ...]:
    def at(state):
        time, a = state
        fields = centre + modes @ a

        def along(direction):
            return jax.jvp(lambda v: rates(time, fields, v), (values,), (direction,))[1]

        whole = rates(time, fields, values)
        if not values.shape[0]:
            return (whole,)
        added = lax.map(along, jnp.diag(values))
        return (whole - jnp.sum(added, axis=0), *added)

    return lax.map(at, (time, coordinates))
