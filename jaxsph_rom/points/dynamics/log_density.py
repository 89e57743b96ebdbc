"""The density variable in which the weakly compressible equations are quadratic."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsph import Fluid


def to_log_density(density: Float[Array, "*shape"], fluid: Fluid) -> Float[Array, "*shape"]:
    """r = rho0 (1 + ln(rho / rho0)) [kg/m^3], rho itself to first order about rho0."""
    return fluid.reference_density * (1.0 + jnp.log(density / fluid.reference_density))


def from_log_density(log_density: Float[Array, "*shape"], fluid: Fluid) -> Float[Array, "*shape"]:
    """rho = rho0 exp(r / rho0 - 1) [kg/m^3]."""
    return fluid.reference_density * jnp.exp(log_density / fluid.reference_density - 1.0)
