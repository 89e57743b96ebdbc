"""What acts on a flow from outside, as a few numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsph import SPHFunctional
from jaxsph.effects import BodyForce

from ..points.dynamics.coefficients import Coefficients

_TIMES = 64  # at which forces are looked at
_STEADY = 1e-9  # of the largest acceleration: what changes less does not change


class Inputs(eqx.Module):
    """p(t; theta): coefficients that scenes differ in, as a viscosity, and the components of the
    body forces' sum that change with time or from scene to scene, each about its middle and in its
    own size:

        p = (theta_own - m, b(t; theta) - m) / s.

    Forces are taken at one place; those that differ from place to place and in time as well are no
    input.

    Args:
        functional: of the first scene.
        coefficients: theta, all that scenes differ in.
        place: where forces are taken (1, n) [m].
        middle, size: m, s.
        own: which coefficients are no body force's (static).
        axes: which components of the forces change (static).
    """

    functional: SPHFunctional
    coefficients: Coefficients
    place: Float[Array, "1 dim"]
    middle: Float[Array, " inputs"]
    size: Float[Array, " inputs"]
    own: tuple[int, ...] = eqx.field(static=True)
    axes: tuple[int, ...] = eqx.field(static=True)

    @classmethod
    def between(
        cls,
        functionals: Sequence[SPHFunctional],
        place: Float[Array, " dim"],
        end_time: float,
    ) -> Self:
        """Of scenes, which run to an end time [s]."""
        first = functionals[0]
        coefficients = Coefficients.between(functionals)
        values = jnp.stack([coefficients.values(f) for f in functionals])
        forces = [f".effects[{k}]" for k, e in enumerate(first.effects) if isinstance(e, BodyForce)]
        own, number = [], 0
        for part in coefficients.parts:
            mine = any(not place.startswith(tuple(forces)) for place in part.places)
            own += list(range(number, number + len(part.directions))) if mine else []
            number += len(part.directions)
        dim = len(place)
        bare = cls(
            first, coefficients, jnp.asarray(place)[None, :], jnp.zeros(len(own) + dim),
            jnp.ones(len(own) + dim), tuple(own), tuple(range(dim)),
        )  # fmt: skip
        times = jnp.linspace(0.0, end_time, _TIMES, dtype=first.mass.dtype)
        seen = np.asarray(jax.jit(jax.vmap(lambda v: jax.vmap(lambda t: bare.raw(t, v))(times)))(
            values
        ))  # fmt: skip
        seen = seen.reshape(-1, len(own) + dim)
        low, high = seen.min(axis=0), seen.max(axis=0)
        largest = np.abs(seen[:, len(own) :]).max(initial=0.0)
        axes = [a for a in range(dim) if np.ptp(seen[:, len(own) + a]) > _STEADY * largest]
        kept = [*range(len(own)), *(len(own) + a for a in axes)]
        middle, size = 0.5 * (low + high)[kept], 0.5 * (high - low)[kept]
        dtype = first.mass.dtype
        return cls(
            first, coefficients, bare.place, jnp.asarray(middle, dtype), jnp.asarray(size, dtype),
            tuple(own), tuple(axes),
        )  # fmt: skip

    @property
    def count(self) -> int:
        return len(self.own) + len(self.axes)

    def raw(self, time, values) -> Float[Array, " inputs"]:
        """Coefficients and components as they are."""
        functional = self.coefficients.applied(self.functional, values)
        parts = [values[jnp.asarray(self.own, int)]] if self.own else []
        if self.axes:
            forces = [e for e in functional.effects if isinstance(e, BodyForce)]
            total = sum(e.acceleration(time, self.place)[0] for e in forces)
            total = total if forces else jnp.zeros_like(self.place[0])
            parts.append(total[jnp.asarray(self.axes)])
        return jnp.concatenate(parts) if parts else jnp.zeros(0, self.place.dtype)

    def __call__(
        self, time: Float[Array, ""], values: Float[Array, " coefficients"]
    ) -> Float[Array, " inputs"]:
        """p at a time [s] and at theta."""
        return (self.raw(time, values) - self.middle) / self.size
