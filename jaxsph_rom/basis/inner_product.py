"""How states are measured: the inner product of the state space."""

from __future__ import annotations

import abc

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsph import Fluid

from .centring import Centring, RestCentred, Uncentred


class InnerProduct(eqx.Module):
    """How states are measured, density and velocity together:

        <a, b> = sum over points and fields f of w_f a_f b_f

    with fields (rho, u).
    """

    @abc.abstractmethod
    def weights(self, fluid: Fluid, dim: int) -> Float[Array, " fields"]:
        """w_f of density and velocity components."""

    @property
    @abc.abstractmethod
    def centring(self) -> Centring:
        """Where fluctuations are taken from unless one says otherwise."""


class Euclidean(InnerProduct):
    """The raw stacked state, unscaled; uncentred unless one says otherwise (paper)."""

    def weights(self, fluid, dim):
        return jnp.ones(1 + dim, fluid.reference_density.dtype)

    @property
    def centring(self):
        return Uncentred()


class Energy(InnerProduct):
    """Kinetic plus acoustic energy, about the state of rest unless one says otherwise:

        <w, w> = sum |u|^2 + (c0 / rho0)^2 (rho - rho0)^2,

    the symmetriser of the linearised weakly compressible equations.
    """

    def weights(self, fluid, dim):
        ratio = fluid.sound_speed / fluid.reference_density
        return jnp.ones(1 + dim, ratio.dtype).at[0].set(ratio**2)

    @property
    def centring(self):
        return RestCentred()
