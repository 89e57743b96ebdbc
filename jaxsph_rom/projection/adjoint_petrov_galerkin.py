"""Adjoint Petrov-Galerkin projection."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .base import Projection


class AdjointPetrovGalerkin(Projection):
    """d(w^)/dt = Phi^+ [f-bar + tau J Pi' f-bar] (paper, eq. APG; Parish et al. 2020).

    J is the derivative of f-bar with respect to (rho, u) at frozen positions (particle volumes
    m / rho included); its action is that of `jax.jvp`, by `jax.linearize`, which passes over the
    pairs once for f-bar and for what J needs of it. The paper takes a finite difference.

    Args:
        tau: memory length [s].
    """

    tau: Float[Array, ""] = eqx.field(converter=jnp.asarray)

    @property
    def name(self):
        return "apg"

    def reduce(self, inverse, functional, state):
        rates, jacobian, beside = jax.linearize(functional, state, has_aux=True)
        memory = jacobian(inverse.complement(rates))
        return inverse(rates + self.tau.astype(rates.dtype) * memory), beside
