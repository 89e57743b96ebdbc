"""Pressure force and continuity whose discrete energy is conserved to round-off."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..at_ghosts import Otherwise, Same
from ..kernel_moments import lattice_moments
from ..pairs import PairTerm, pair_sum
from ..ramps import ramp
from ..symmetric import product, times
from .base import Context, Effect, given
from .continuity import Continuity
from .pressure_force import PressureForce
from .wall_pressure import GHOST_WEIGHT, WallPressure, own_volume, per_weight

_LONELY = 0.05  # of a full neighbourhood's kernel sum: no mean is taken over fewer
_BESIDE = (0.0, 0.02)  # of the kernel's sum that is ghosts'; beside a wall it is a quarter


def neighbor_share(pair, i, j):
    """W_ij V_j"""
    return pair.kernel * j.volume


def neighbor_velocity(pair, i, j):
    """u_j W_ij V_j"""
    return j.velocity * (pair.kernel * j.volume)


def smooth_divergence(pair, i, j):
    """(s_j - s_i) . L_i grad_i W_ij V_j"""
    return (j.smooth_velocity - i.smooth_velocity).dot(product(i.correction, pair.gradient))


def rough(pair, one):
    """(u - s) . L grad_i W_ij V_j of one of the two"""
    return (one.velocity - one.smooth_velocity).dot(product(one.correction, pair.gradient))


def rough_divergence(pair, i, j):
    """[L_j (u_j - s_j) + L_i (u_i - s_i)] . grad_i W_ij V_j"""
    return rough(pair, j) + rough(pair, i)


def pressure_difference(pair, i, j):
    """(p_j - p_i) grad_i W_ij V_j"""
    return pair.gradient * (j.acting_pressure - i.acting_pressure)


def pressed(pair, one):
    """p L grad_i W_ij V_j of one of the two"""
    return product(one.correction, pair.gradient) * one.acting_pressure


def pressure_flux(pair, i, j):
    """(p_i L_i + p_j L_j) grad_i W_ij V_j"""
    return pressed(pair, i) + pressed(pair, j)


def handed_force(pair, i, j):
    """q_j W_ij, q_j with its volume"""
    return j.smoothed_force * pair.kernel


def ghost_mean_pressure(pair, i, j):
    """p_j W_ij"""
    return j.acting_pressure * pair.kernel


def ghost_mean_velocity(pair, i, j):
    """s_j W_ij"""
    return j.smooth_velocity * pair.kernel


def ghost_flux(pair, i, j):
    """L_j (u_j - s_j) . grad_i W_ij V_j"""
    return rough(pair, j)


def ghost_force(pair, i, j):
    """p_j L_j grad_i W_ij V_j"""
    return pressed(pair, j)


def wall_rough_divergence(pair, i, j):
    """L_i (u_i - s_i) . grad_i W_ig V_g, and the particle's share of what the ghost gathered"""
    return rough(pair, i) + j.handed_flux * (pair.kernel / own_volume(i))


def wall_pressure_flux(pair, i, j):
    """p_i L_i grad_i W_ig V_g, and the particle's share of what the ghost gathered"""
    return pressed(pair, i) + j.handed_force * (pair.kernel / own_volume(i))


WALL_SHARE = PairTerm("wall_share", (), None, Otherwise((), neighbor_share))
_ROUGH = ("velocity", "smooth_velocity", "correction")
_PRESSED = ("acting_pressure", "correction")
_GATHERED = (
    GHOST_WEIGHT,
    PairTerm("ghost_mean_pressure", ("acting_pressure",), ghost_mean_pressure),
    PairTerm("ghost_mean_velocity", ("smooth_velocity",), ghost_mean_velocity),
    PairTerm("ghost_flux", _ROUGH, ghost_flux),
    PairTerm("ghost_force", _PRESSED, ghost_force),
)
_HANDED = (PairTerm("handed_force", ("smoothed_force",), handed_force),)


class AdjointPressure(Effect):
    """du_i/dt = -G p / rho_i and drho_i/dt = -rho_i D u, D and G each other's negative adjoint:

        sum_i V_i u_i . (G p)_i = -sum_i V_i p_i (D u)_i,

    so that they only exchange kinetic for acoustic energy, on particles however disordered and
    beside any wall (derivation: docs, "the consistent scheme"). Both are accurate on smooth fields:

        D = C S - Q^T T (1 - S),    G = (1 - S^T) T Q + S^T P,
        (C u)_i = sum_j (u_j - u_i) . L_i grad W_ij V_j,
        (Q p)_i = L_i sum_j (p_j - p_i) grad W_ij V_j,
        (P p)_i = sum_j (p_i L_i + p_j L_j) grad W_ij V_j = -C^T p,

    transposes in the volume-weighted product, S the mean over a particle's neighbours, weighted by
    W_ij V_j. A smooth velocity meets the consistent divergence C, the rough rest of it the adjoint
    of the consistent gradient; a smooth pressure the consistent gradient Q, and what the adjoint of
    C does otherwise on disordered particles only in the mean over neighbours, where it cancels.
    T = 1 + theta, with theta = (sum F r^4 / (n + 2)) sum W / (sum F r^2 sum W r^2 / n) on the
    lattice and F = -W'/r, removes the error of second order that the kernel's width makes.

    At walls a ghost's pressure in Q is the mean p_g = sum_k w_gk p_k over the particles near it,
    w_gk = W_gk / sum_k W_gk; its velocity in C the mean of S u there, mirrored at the wall. The
    adjoints follow: what ghosts gather of their neighbours goes back to these by the same w_gk.

    A uniform pressure does nothing to a fluid that fills its box: p is taken less its mean, and D
    less its own, unless fluid comes in and goes out through `Openings`. Where a body force has a
    potential Phi, p is taken less the pressure of the fluid at rest in it, of enthalpy C - Phi_i
    with C the mean of a particle's own enthalpy plus Phi, and that pressure's force
    -b rho_rest / rho_i added in closed form; so a fluid at rest stays there.

    Beside a wall S is a mean over one side. Where a flow meets a wall head-on and turns, it takes
    the fluid farther out for that at the wall. X S + 1 - X in place of S, X any diagonal, has the
    same identities: X falls from 1 to `boundary_smoothing` where ghosts hold a fiftieth of the
    kernel's sum.

    Needs `KernelCorrection` before it. Not for free surfaces, nor for bodies that are moved.

    Args:
        boundary_smoothing: X in the layer beside a wall, 0 to 1.

    Raises:
        ValueError: where bodies are moved through the fluid, and beside `FreeSurface`.
    """

    boundary_smoothing: Float[Array, ""] = eqx.field(converter=jnp.asarray, default=1.0)

    def on_fixed_points(self):
        # in good order the plain pair is accurate, and each other's adjoint as it is
        return (Continuity(), PressureForce(), WallPressure())

    def geometry_terms(self, context):
        return (
            PairTerm("neighbor_share", (), neighbor_share),
            PairTerm("neighbor_velocity", ("velocity",), neighbor_velocity),
            WALL_SHARE,
        )

    def fields(self, context, fields, sums):
        if "interior" in fields:
            raise ValueError(
                "effects: AdjointPressure is for a fluid that fills its box; with FreeSurface list "
                "Continuity and PressureForce."
            )
        velocity = fields["velocity"]
        given(fields, "correction", self, "KernelCorrection")
        acting, balance = _acting_pressure(context, fields)
        share = sums["neighbor_share"]
        met = share > _LONELY
        share = jnp.where(met, share, 1.0)[:, None]
        beside = ramp(sums["wall_share"], *_BESIDE) if "wall_share" in sums else 0.0
        smoothing = jnp.where(met, 1.0 - (1.0 - self.boundary_smoothing) * beside, 0.0)[:, None]
        rough = smoothing * (velocity - sums["neighbor_velocity"] / share)
        return balance | {
            "acting_pressure": acting,
            "smoothing": smoothing,
            "neighbor_weight": smoothing / share,
            "smooth_velocity": velocity - rough,
        }

    def rate_terms(self, context):
        smooth = ("smooth_velocity", "correction")
        mirrored = Otherwise(("smooth_velocity",), smooth_divergence)
        flux = Otherwise(("handed_flux",), wall_rough_divergence)
        force = Otherwise(("handed_force",), wall_pressure_flux)
        return (
            PairTerm("smooth_divergence", smooth, smooth_divergence, mirrored),
            PairTerm("rough_divergence", _ROUGH, rough_divergence, flux),
            PairTerm("pressure_difference", ("acting_pressure",), pressure_difference, Same()),
            PairTerm("pressure_flux", _PRESSED, pressure_flux, force),
        )

    def ghost_terms(self, context):
        if context.bodies is None:
            return _GATHERED
        raise ValueError(
            "effects: AdjointPressure knows walls that rest or slide along themselves; for bodies "
            "that are moved through the fluid list Continuity and PressureForce."
        )

    def ghost_fields(self, context, ghosts, sums):
        normal, space = ghosts["normal"], context.space

        def mean(total):
            return per_weight(total, sums["ghost_weight"], space)

        def mirrored(total):
            vectors = jax.vmap(mean, 1, 1)(total)
            return vectors - 2.0 * jnp.sum(vectors * normal, axis=1, keepdims=True) * normal

        volume = ghosts["volume"]
        return {
            "acting_pressure": mean(sums["ghost_mean_pressure"]),
            "smooth_velocity": mirrored(sums["ghost_mean_velocity"]),
            "handed_flux": volume * mean(sums["ghost_flux"]),
            "handed_force": volume[:, None] * mirrored(sums["ghost_force"]),
        }

    def rates(self, context, fields, sums):
        density, volume = fields["density"], fields["volume"]
        sharp = 1.0 + _sharpening(context.space)
        gradient = sharp * times(fields["correction"], sums["pressure_difference"])
        excess = sums["pressure_flux"] - gradient
        smoothed = (volume[:, None] * fields["neighbor_weight"]) * excess
        handed = pair_sum(
            _HANDED, fields | {"smoothed_force": smoothed}, context.space, context.pairs
        )
        gradient = gradient + (1.0 - fields["smoothing"]) * excess + handed["handed_force"]
        divergence = sums["smooth_divergence"] + sharp * sums["rough_divergence"]
        if context.parking is None:
            divergence = divergence - _mean(context, fields, divergence)
        velocity = -gradient / density[:, None]
        if "balanced_force" in fields:
            velocity = velocity - fields["balanced_force"]
        return {"velocity": velocity, "density": -density * divergence}

    def on_walls(self, context, fields, surface):
        """What the pressure that is taken out, the mean and that at rest, does to the walls."""
        rest, pressure = _Rest.of(context, fields), fields["pressure"]
        if not rest.forces:
            mean = jnp.broadcast_to(_mean(context, fields, pressure), surface.points.shape[:1])
            return surface.pressed(mean, jnp.zeros_like(fields["velocity"][0]))
        density, there = rest.density(fields["position"]), rest.density(surface.points)
        mean = _mean(context, fields, pressure - context.fluid.pressure(density))
        weight = context.mass * jnp.sum(rest.force_per_mass(density, fields), axis=0)
        return surface.pressed(context.fluid.pressure(there) + mean, weight)


def _acting_pressure(context, fields):
    """p less its mean and the pressure at rest (N,) [Pa]; that one's force, if there is any."""
    rest = _Rest.of(context, fields)
    acting = fields["pressure"]
    balance = {}
    if rest.forces:
        density = rest.density(fields["position"])
        acting = acting - context.fluid.pressure(density)
        balance["balanced_force"] = rest.force_per_mass(density, fields)
    return acting - _mean(context, fields, acting), balance


def _mean(context, fields, values):
    """Over the volume of the fluid that is in the flow."""
    volume = fields["volume"]
    if context.parking is not None:
        volume = jnp.where(context.parking.holds(fields["position"]), 0.0, volume)
    return jnp.sum(volume * values) / jnp.sum(volume)


class _Rest(NamedTuple):
    """The fluid at rest in the forces that have a potential.

    Args:
        context: time and fluid are read.
        forces: their conservative parts.
        level: C, the mean enthalpy plus Phi [m^2/s^2].
    """

    context: Context
    forces: tuple
    level: Array | None

    @classmethod
    def of(cls, context, fields):
        parts = (force.conservative_part(context.space.box) for force in context.forces)
        rest = cls(context, tuple(part for part in parts if part is not None), None)
        if not rest.forces:
            return rest
        total = context.fluid.enthalpy(fields["density"]) + rest.potential(fields["position"])
        return rest._replace(level=_mean(context, fields, total))

    def potential(self, position):
        return sum(force.potential(self.context.time, position) for force in self.forces)

    def density(self, position):
        """rho_rest (P,) at positions."""
        return self.context.fluid.density_of_enthalpy(self.level - self.potential(position))

    def force_per_mass(self, density, fields):
        """b rho_rest / rho_i (N, n), `density` being rho_rest at the particles."""
        time, position = self.context.time, fields["position"]
        acceleration = sum(force.acceleration(time, position) for force in self.forces)
        return (density / fields["density"])[:, None] * acceleration


def _sharpening(space) -> float:
    """theta."""
    dim = space.box.dim
    h_over_dx = round(space.smoothing_length / space.spacing, 12)
    moments = lattice_moments(space.kernel, dim, h_over_dx)
    slope = moments["slope_4"] / (dim + 2) / moments["slope_2"]
    return slope / (moments["kernel_2"] / dim / moments["kernel"])
