"""The velocity of ghosts as viscosity sees it: no-slip and free-slip walls."""

import jax
import jax.numpy as jnp

from ..pairs import PairTerm
from .base import Effect
from .wall_pressure import GHOST_WEIGHT, per_weight


def ghost_velocity(pair, i, j):
    """u_j W_ij"""
    return j.velocity * pair.kernel


def _near_velocity(sums, space):
    """<u>_i = sum_j u_j W_ij / sum_j W_ij"""
    mean = jax.vmap(lambda total: per_weight(total, sums["ghost_weight"], space), 1, 1)
    return mean(sums["ghost_velocity"])


class NoSlip(Effect):
    """The fluid's velocity, extrapolated through the wall's own at the surface, for ghost i:

        u_i = 2 u_w - <u>_i,    <u>_i = sum_j u_j W_ij / sum_j W_ij

    (Adami et al. 2012, eq. 23), u_w the wall's velocity, j the fluid particles. The paper reverses
    the tangential part only; the normal part plays no role in a viscous sum beside a wall that
    keeps it near zero.
    """

    def ghost_terms(self, context):
        return (GHOST_WEIGHT, PairTerm("ghost_velocity", ("velocity",), ghost_velocity))

    def ghost_fields(self, context, ghosts, sums):
        near = _near_velocity(sums, context.space)
        return {"velocity": 2.0 * ghosts["wall_velocity"] - near}


class FixedWallVelocity(Effect):
    """u_i = u_w at ghost i: the other reading of the paper's lid of "fixed ghost particles".

    The fluid then meets the wall's velocity about half a spacing behind the surface, to first
    order only; `NoSlip` is more accurate.
    """

    def ghost_fields(self, context, ghosts, sums):
        return {"velocity": ghosts["wall_velocity"]}


class FreeSlip(Effect):
    """The mirror image of the fluid's velocity, for ghost i:

        u_i = <u>_i - 2 (<u>_i . n) n,

    n the wall's normal, and the mean over the fluid particles as in `NoSlip`; where bodies are
    moved, the normal part reversed is that of the mean less the wall's velocity.
    """

    def ghost_terms(self, context):
        return (GHOST_WEIGHT, PairTerm("ghost_velocity", ("velocity",), ghost_velocity))

    def ghost_fields(self, context, ghosts, sums):
        near, normal = _near_velocity(sums, context.space), ghosts["normal"]
        moving = "wall_acceleration" in ghosts
        approach = near - ghosts["wall_velocity"] if moving else near
        across = jnp.sum(approach * normal, axis=1, keepdims=True)
        return {"velocity": near - 2.0 * across * normal}
