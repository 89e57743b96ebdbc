"""Surface tension of a free surface."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..pairs import PairTerm
from ..ramps import ramp, root
from ..vector import Vector
from .base import Effect
from .kernel_gradient import KERNEL_GRADIENT

# h |g| is 0.68, 0.28, 0.04, 0.00 in the rows under a flat surface at h = 2 dx
_SOUND = (0.05, 0.15)
_FADED = (0.02, 0.06)
_SHARPEST = 1.0  # of h times the curvature
_SINGULAR = 1e-3


def tangent_matrix(pair, i, j):
    """s_j (x_j - x_i) (x) grad_i W_ij V_j, row by row, s the share of j in the surface"""
    g = pair.gradient * j.surface_share
    return Vector(d * slope for d in pair.separation for slope in g)


def normal_slope(pair, i, j):
    """s_j (n_j - n_i) (x) grad_i W_ij V_j, row by row"""
    g = pair.gradient * j.surface_share
    return Vector(n * slope for n in j.surface_normal - i.surface_normal for slope in g)


class SurfaceTension(Effect):
    """du_i/dt = 2 sigma kappa_i f_i g_i / rho_i, a force that acts where the surface is seen
    (Brackbill et al. 1992; Morris 2000), with

        g_i = sum_j grad_i W_ij V_j,    n_i = -g_i / |g_i|,
        kappa_i = tr([sum_j s_j (n_j - n_i) (x) grad_i W_ij V_j]
                     [sum_j s_j (x_j - x_i) (x) grad_i W_ij V_j]^-1).

    |g| spreads the surface over the few rows of particles that see it, and half of the spread is
    where there are no particles, hence the 2. The pressure force of a constant pressure p is
    -2 p g_i / rho_i, so p = sigma kappa is in balance with the tension on every particle, however
    the particles lie. s is 1 in the rows whose normals are sound and 0 deeper; f fades out where g
    is but noise. These rows lie a little under the surface, on average 0.4 h: their curvature is
    larger than the surface's by as much as their length is less, and mode n of a drop of radius R
    finds the tension weaker by (n - 1) 0.4 h / R. Stands behind `FreeSurface`, whose normal it
    reads.

    Args:
        tension: sigma [N/m].
    """

    tension: Float[Array, ""] = eqx.field(converter=jnp.asarray)

    def step_limit(self, fluid, space):
        """(rho0 h^3 / (2 pi sigma))^1/2: capillary waves as short as h (Brackbill et al. 1992)."""
        wave = fluid.reference_density * space.smoothing_length**3
        return jnp.sqrt(wave / (2.0 * jnp.pi * self.tension))

    def geometry_terms(self, context):
        return (KERNEL_GRADIENT,)

    def fields(self, context, fields, sums):
        gradient = sums["kernel_gradient"]
        scaled = gradient * context.space.smoothing_length
        seen = root(jnp.sum(scaled * scaled, axis=1))
        return {
            "surface_share": ramp(seen, *_SOUND),
            "surface_gradient": ramp(seen, *_FADED)[:, None] * gradient,
        }

    def rate_terms(self, context):
        return (
            PairTerm("tangent_matrix", ("surface_share",), tangent_matrix),
            PairTerm("normal_slope", ("surface_share", "surface_normal"), normal_slope),
        )

    def rates(self, context, fields, sums):
        curvature = _trace(sums["normal_slope"], sums["tangent_matrix"])
        sharpest = _SHARPEST / context.space.smoothing_length
        curvature = jnp.clip(curvature, -sharpest, sharpest)
        pull = 2.0 * self.tension * curvature / fields["density"]
        return {"velocity": pull[:, None] * fields["surface_gradient"]}


def _trace(slope, matrix):
    """tr(S M^-1) of matrices (N, n n) given row by row; 0 where M is singular."""
    dim = 2 if slope.shape[1] == 4 else 3
    slope, matrix = (a.reshape(-1, dim, dim) for a in (slope, matrix))
    regular = jnp.abs(jnp.linalg.det(matrix)) > _SINGULAR
    safe = jnp.where(regular[:, None, None], matrix, jnp.eye(dim, dtype=matrix.dtype)[None])
    found = jnp.trace(slope @ jnp.linalg.inv(safe), axis1=1, axis2=2)
    return jnp.where(regular, found, 0.0)
