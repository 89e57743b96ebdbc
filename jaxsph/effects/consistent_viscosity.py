"""Laminar viscosity that is exact for linear fields and sharp for smooth ones."""

from dataclasses import dataclass

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..at_ghosts import Same
from ..kernel_moments import lattice_moments, slope_moment
from ..pairs import PairTerm
from ..symmetric import along
from .base import Effect, given, viscous_step_limit

_LEAST = 0.1  # of a trace, which few neighbours leave near zero
_LEAST_ON_LATTICE = 0.25  # 0.5 to 0.7 where neighbours are enough


@dataclass(frozen=True)
class SharpWeight:
    """F_ij V_j with F = -W'/r (1 - r^2 / R^2), whose fourth moment is zero"""

    inverse_square: float  # 1 / R^2

    def slope(self, pair):
        return pair.radial_slope * (1.0 - self.inverse_square * pair.squared_distance)


@dataclass(frozen=True)
class SharpLaplacian(SharpWeight):
    """(u_j - u_i) F_ij V_j"""

    def __call__(self, pair, i, j):
        return (j.velocity - i.velocity) * self.slope(pair)


@dataclass(frozen=True)
class SharpTrace(SharpWeight):
    """r^2 F_ij V_j"""

    def __call__(self, pair, i, j):
        return pair.squared_distance * self.slope(pair)


@dataclass(frozen=True)
class SharpGradient(SharpWeight):
    """(x_j - x_i) F_ij V_j"""

    def __call__(self, pair, i, j):
        return pair.separation * self.slope(pair)


class ConsistentViscosity(Effect):
    """Laminar viscosity, one component of velocity as the other:

        du_i/dt = 2 n nu rho0 / (rho_i t_i) [sum_j (u_j - u_i) F_ij V_j - <grad u>_i g_i],
        t_i = sum_j r^2 F_ij V_j,    g_i = sum_j (x_j - x_i) F_ij V_j,

    ghosts included: the sum of Morris, Fox and Zhu (1997) with a weight F = -W'/r (1 - r^2/R^2)
    that has no fourth moment, R^2 = h^2 I_6 / I_4 with I_k the moments of -W'/r, so that the error
    that the kernel's width makes is of fourth order; normalised by what the neighbours there are
    give, and without what a linear field leaves on disordered particles. It does not conserve
    angular momentum. Needs `KernelCorrection`.

    Args:
        viscosity: kinematic viscosity nu [m^2/s].

    Raises:
        ValueError: where h/dx leaves too few neighbours for that weight: t near zero on a lattice.
    """

    viscosity: Float[Array, ""] = eqx.field(converter=jnp.asarray)

    def step_limit(self, fluid, space):
        _weight(space)  # a scene refuses here what it could not run
        return viscous_step_limit(self.viscosity, space)

    def geometry_terms(self, context):
        weight = _weight(context.space)
        return (
            PairTerm("sharp_trace", (), SharpTrace(weight), Same()),
            PairTerm("sharp_gradient", (), SharpGradient(weight), Same()),
        )

    def fields(self, context, fields, sums):
        gradient = given(fields, "velocity_gradient", self, "KernelCorrection")
        linear = along(gradient, sums["sharp_gradient"])
        return {"sharp_trace": sums["sharp_trace"], "linear_part": linear}

    def on_walls(self, context, fields, surface):
        """What walls that turn feel beside mu du/dn, their own velocity being no uniform one.

        Raises:
            ValueError: where bodies are free, whose turn is not known beforehand.
        """
        if context.bodies is not None and context.bodies.free is not None:
            raise ValueError(
                "effects: ConsistentViscosity does not know the torque on bodies that are free; "
                "list LaminarViscosity instead."
            )
        return surface.turned(self.viscosity * context.fluid.reference_density)

    def rate_terms(self, context):
        laplacian = SharpLaplacian(_weight(context.space))
        return (PairTerm("sharp_laplacian", ("velocity",), laplacian, Same()),)

    def rates(self, context, fields, sums):
        factor = 2.0 * context.space.box.dim * self.viscosity * context.fluid.reference_density
        factor = factor / (fields["density"] * jnp.maximum(fields["sharp_trace"], _LEAST))
        return {"velocity": factor[:, None] * (sums["sharp_laplacian"] - fields["linear_part"])}


def _weight(space) -> float:
    kernel, dim = space.kernel, space.box.dim
    ratio = slope_moment(kernel, dim, 4) / slope_moment(kernel, dim, 6)
    h_over_dx = round(space.smoothing_length / space.spacing, 12)
    moments = lattice_moments(kernel, dim, h_over_dx)
    if moments["slope_2"] - moments["slope_4"] * ratio / h_over_dx**2 < _LEAST_ON_LATTICE:
        raise ValueError(
            f"h_over_dx: {h_over_dx:g} leaves {type(kernel).__name__} too few neighbours for "
            "ConsistentViscosity; take 1.25 or more."
        )
    return ratio / space.smoothing_length**2
