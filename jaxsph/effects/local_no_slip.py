"""No-slip walls that are exact for a linear profile."""

from dataclasses import dataclass

import equinox as eqx
import jax.numpy as jnp

from ..pairs import PairTerm
from ..vector import Vector
from ..walls.region import Region
from .base import Effect

_STEEPEST = 8.0  # times the fluid's own difference to the wall
_NEAREST = 0.1  # times dx: a mean distance of the particles near a ghost counts as this at least


@dataclass(frozen=True)
class NearWeight:
    """(W_ij / W(dx))^4: the nearest particles"""

    scale: float

    def weight(self, pair):
        weight = pair.kernel * self.scale
        weight = weight * weight
        return weight * weight

    def __call__(self, pair, i, j):
        return self.weight(pair)


@dataclass(frozen=True)
class NearVelocity(NearWeight):
    """u_j (W_ij / W(dx))^4"""

    def __call__(self, pair, i, j):
        return j.velocity * self.weight(pair)


@dataclass(frozen=True)
class NearSeparation(NearWeight):
    """(x_j - x_i) (W_ij / W(dx))^4"""

    def __call__(self, pair, i, j):
        weight = self.weight(pair)
        return Vector(d * weight for d in pair.separation)


class LocalNoSlip(Effect):
    """The fluid's velocity continued through the wall's own along a straight line, for ghost i:

        u_i = u_w - (U_i - u_w) d_i / D_i,

    d_i the ghost's depth in the wall, U_i and D_i the velocity and the distance to the wall of the
    particles near it, means weighted by W_ij^4 (after Morris, Fox and Zhu 1997, who take each
    particle's own). `NoSlip` has d_i / D_i = 1.

    Args:
        fluid_region: where fluid may be (static).
    """

    fluid_region: Region = eqx.field(static=True)

    def ghost_terms(self, context):
        scale = 1.0 / context.space.kernel_at_spacing
        return (
            PairTerm("near_weight", (), NearWeight(scale)),
            PairTerm("near_velocity", ("velocity",), NearVelocity(scale)),
            PairTerm("near_separation", (), NearSeparation(scale)),
        )

    def ghost_fields(self, context, ghosts, sums):
        weight, wall = sums["near_weight"], ghosts["wall_velocity"]
        reached = weight > 1e-30
        safe = jnp.where(reached, weight, 1.0)[:, None]
        near = jnp.where(reached[:, None], sums["near_velocity"] / safe, wall)
        apart = sums["near_separation"] / safe
        depth = self.fluid_region.signed_distance(ghosts["position"])
        distance = jnp.sum(apart * ghosts["normal"], axis=1) - depth
        distance = jnp.maximum(distance, _NEAREST * context.space.spacing)
        ratio = jnp.clip(depth / distance, 0.0, _STEEPEST)
        return {"velocity": wall - ratio[:, None] * (near - wall)}
