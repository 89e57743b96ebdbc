"""How states are measured: inner product and centre of the state space."""

from __future__ import annotations

import abc

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsph import Fluid


class InnerProduct(eqx.Module):
    """<a, b> = sum over points and fields f of w_f a_f b_f, about a centre; fields (rho, u)."""

    @abc.abstractmethod
    def weights(self, fluid: Fluid, dim: int) -> Float[Array, " fields"]:
        """w_f of density and velocity components."""

    @abc.abstractmethod
    def centre(self, fluid: Fluid, dim: int) -> Float[Array, " fields"]:
        """The state from which fluctuations are taken, per field."""


class Euclidean(InnerProduct):
    """The raw stacked state, uncentred and unscaled (paper)."""

    def weights(self, fluid, dim):
        return jnp.ones(1 + dim, fluid.reference_density.dtype)

    def centre(self, fluid, dim):
        return jnp.zeros(1 + dim, fluid.reference_density.dtype)


class Energy(InnerProduct):
    """Kinetic plus acoustic energy about the state of rest:

        <w, w> = sum |u|^2 + (c0 / rho0)^2 (rho - rho0)^2,

    the symmetriser of the linearised weakly compressible equations.
    """

    def weights(self, fluid, dim):
        ratio = fluid.sound_speed / fluid.reference_density
        return jnp.ones(1 + dim, ratio.dtype).at[0].set(ratio**2)

    def centre(self, fluid, dim):
        return jnp.zeros(1 + dim, fluid.reference_density.dtype).at[0].set(fluid.reference_density)
