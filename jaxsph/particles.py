"""What a particle carries, and what is recorded of it."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .body_state import BodyState
from .content.parts import WHERE_SET


class ParticleState(eqx.Module):
    """Positions [m], velocities [m/s] and densities [kg/m^3] of N particles; also their rates.

    `bodies` is the state of the free bodies in the fluid, if there are any.
    """

    position: Float[Array, "particles dim"]
    velocity: Float[Array, "particles dim"]
    density: Float[Array, " particles"]
    bodies: BodyState | None = eqx.field(default=None, metadata=WHERE_SET)


def in_dtype(tree: Any, dtype) -> Any:
    """A pytree with all its real numbers, those of numpy too, as arrays of one precision."""

    def cast(leaf):
        array = isinstance(leaf, jax.Array | np.ndarray | np.generic)
        real = array and jnp.issubdtype(leaf.dtype, jnp.floating)
        return jnp.asarray(leaf, dtype) if real else leaf

    return jax.tree.map(cast, tree)
