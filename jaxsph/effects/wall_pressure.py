"""The pressure and density of ghosts."""

import jax.numpy as jnp

from ..pairs import PairTerm
from .base import Effect


def ghost_weight(pair, i, j):
    """W_ij"""
    return pair.kernel


def ghost_pressure(pair, i, j):
    """p_j W_ij"""
    return j.pressure * pair.kernel


def ghost_moment(pair, i, j):
    """rho_j (x_i - x_j) W_ij"""
    return pair.separation * (-j.density * pair.kernel)


_REACHED = 1e-20  # of W(dx): so little that a ghost's values do not jump as particles come
GHOST_WEIGHT = PairTerm("ghost_weight", (), ghost_weight)
GHOST_MOMENT = PairTerm("ghost_moment", ("density",), ghost_moment)
_MEAN = (GHOST_WEIGHT, PairTerm("ghost_pressure", ("pressure",), ghost_pressure))


class WallPressure(Effect):
    """Ghost i takes its pressure from the fluid particles j (Adami et al. 2012, eq. 27; paper):

        p_i = [sum_j p_j W_ij + b . sum_j rho_j (x_i - x_j) W_ij] / sum_j W_ij,

    its density from the equation of state, and its volume from that. b [m/s^2] is the sum of the
    body forces that the scene lists, at the ghost, less the acceleration of the body that the ghost
    is part of where bodies are moved (their eq. 27, too); without either its sum is not computed. A
    ghost out of reach of the fluid has p = 0.
    """

    def ghost_terms(self, context):
        return _MEAN if context.bodies is None else (*_MEAN, GHOST_MOMENT)

    def ghost_fields(self, context, ghosts, sums):
        pressure, position = sums["ghost_pressure"], ghosts["position"]
        accelerations = [f.acceleration(context.time, position) for f in context.forces]
        if "wall_acceleration" in ghosts:
            accelerations.append(-ghosts["wall_acceleration"])
        for acceleration in accelerations:
            pressure = pressure + jnp.sum(acceleration * sums["ghost_moment"], axis=1)
        pressure = per_weight(pressure, sums["ghost_weight"], context.space)
        density = context.fluid.density(pressure)
        return {"pressure": pressure, "density": density, "volume": context.mass / density}


def own_volume(i):
    """V_i to divide by: 1 where it is 0, as in the empty slots of a ghost that is dry."""
    return jnp.where(i.volume > 0.0, i.volume, 1.0)


def per_weight(total, weight, space):
    """total / weight, and 0 for a ghost that no fluid particle reaches."""
    reached = weight > _REACHED * space.kernel_at_spacing
    return jnp.where(reached, total / jnp.where(reached, weight, 1.0), 0.0)
