"""From quasi-Lagrangian to Eulerian rates: field advection, as an effect to subtract."""

from __future__ import annotations

import abc
from collections.abc import Callable
from dataclasses import dataclass
from typing import final

import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsph import Mirrored, Otherwise, PairTerm
from jaxsph.at_ghosts import mirrored
from jaxsph.effects import AdjointPressure, ConsistentTransport, Effect, ShiftingTransport
from jaxsph.effects.continuity import VELOCITY_DIVERGENCE


def mass_flux(pair, i, j):
    """(rho_j u_j + rho_i u_i) . grad_i W_ij V_j"""
    return j.velocity.dot(pair.gradient) * j.density + i.velocity.dot(pair.gradient) * i.density


def momentum_flux(pair, i, j):
    """(u_j (x) u_j + u_i (x) u_i) . grad_i W_ij V_j"""
    there, here = j.velocity.dot(pair.gradient), i.velocity.dot(pair.gradient)
    return j.velocity * there + i.velocity * here


def wall_momentum_flux(pair, i, j):
    """(u_g (x) u_j + u_i (x) u_i) . grad_i W_ij V_j, u_j the image of u_i, u_g the ghost's"""
    there = mirrored(i.velocity, j.normal).dot(pair.gradient)
    here = i.velocity.dot(pair.gradient)
    return j.velocity * there + i.velocity * here


class FieldAdvection(Effect):
    """Minus the advection of fields by the flow (paper, eqs. continuity and momentum advection):

        grad rho_i . u_i = sum_j (rho_j u_j + rho_i u_i).grad W V_j
                           - rho_i sum_j (u_j - u_i).grad W V_j,
        grad u_i . u_i   = sum_j (u_j (x) u_j + u_i (x) u_i).grad W V_j
                           - u_i sum_j (u_j - u_i).grad W V_j.

    At a wall the velocity that carries is the particle's own with its normal part reversed, as in
    the continuity equation; the velocity that is carried is the ghost's.
    """

    def rate_terms(self, context):
        velocity, momentum = ("velocity",), Otherwise(("normal", "velocity"), wall_momentum_flux)
        mass = Mirrored("velocity")
        return (
            VELOCITY_DIVERGENCE,
            PairTerm("mass_flux", ("velocity", "density"), mass_flux, mass),
            PairTerm("momentum_flux", velocity, momentum_flux, momentum),
        )

    def transported(self, context, fields, sums):
        divergence = sums["velocity_divergence"]
        return {
            "density": fields["density"] * divergence - sums["mass_flux"],
            "velocity": fields["velocity"] * divergence[:, None] - sums["momentum_flux"],
        }


def acts_on_ghosts(effect: Effect) -> bool:
    """Whether an effect gives the ghosts at walls their values, or has a part in these."""
    given = type(effect)
    return (given.ghost_fields, given.ghost_terms) != (Effect.ghost_fields, Effect.ghost_terms)


def with_sums(effects: tuple[Effect, ...]) -> tuple[Effect, ...]:
    """The effects and the advection of fields by pairwise sums, which is theirs.

    Raises:
        ValueError: if their continuity is no pairwise sum that these would cancel.
    """
    if any(isinstance(effect, AdjointPressure) for effect in effects):
        raise ValueError(
            "advection: the paper's sums belong to the delta-plus scheme, and this scene has "
            "AdjointPressure; take ModeAdvection(), or the scene with scheme=DeltaPlus()."
        )
    return (*effects, FieldAdvection())


@dataclass(frozen=True)
class Advection(abc.ABC):
    """How the Eulerian functional f-bar follows from a scene's effects."""

    @property
    @abc.abstractmethod
    def name(self) -> str:
        """As users type it."""

    @abc.abstractmethod
    def eulerian(self, effects: tuple[Effect, ...]) -> tuple[Effect, ...]:
        """The effects of f-bar."""

    def remaining(
        self,
        rates: Float[Array, "particles fields"],
        density: Float[Array, " particles"],
        carried: Callable[[], Float[Array, "particles fields"]],
    ) -> Float[Array, "particles fields"]:
        """f-bar of (rho, u) from the rates of these effects.

        Args:
            rates: of (rho, u) by these effects.
            density: of the particles [kg/m^3].
            carried: makes v . grad (rho, u), v = dx/dt, from the modes' own gradients.
        """
        return rates


@final
@dataclass(frozen=True)
class PaperAdvection(Advection):
    """Advection by u alone is subtracted, as printed; the shift-velocity terms stay."""

    @property
    def name(self):
        return "paper"

    def eulerian(self, effects):
        return with_sums(effects)


@final
@dataclass(frozen=True)
class ConsistentAdvection(Advection):
    """Advection by u + du is subtracted: the shift-velocity terms cancel and are not computed.

    (In the momentum equation up to the factor rho0 / rho_i, below a percent.)
    """

    @property
    def name(self):
        return "consistent"

    def eulerian(self, effects):
        transports = ShiftingTransport | ConsistentTransport
        return with_sums(tuple(e for e in effects if not isinstance(e, transports)))


@final
@dataclass(frozen=True)
class ModeAdvection(Advection):
    """The effects stay as they are, and what the modes that a particle passes change by is taken:

        f-bar = f - v . grad(w_c + Phi w^),    v = dx/dt = u + du,

    with the gradient of the interpolated modes themselves. Then d/dt of the fields that a particle
    carries is f, projected: what f conserves or loses the reduced model conserves or loses, too.
    """

    @property
    def name(self):
        return "modes"

    def eulerian(self, effects):
        return effects

    def remaining(self, rates, density, carried):
        return rates - carried()


@final
@dataclass(frozen=True)
class Gauged(Advection):
    """An advection whose density rates are taken less their mean over the fluid's volume:

        drho_i/dt - sum_j V_j drho_j/dt / sum_j V_j,

    so that the pressure's level stays where the fluid fills a closed or periodic domain.

    Args:
        of: how f-bar is made otherwise.
    """

    of: Advection

    @property
    def name(self):
        return f"{self.of.name}-gauged"

    def eulerian(self, effects):
        """As the other's.

        Raises:
            ValueError: if the fluid has a free surface, where the mean density may change.
        """
        if any(effect.frees_surface for effect in effects):
            raise ValueError(
                "advection: Gauged holds the mean density of a fluid that fills its domain, and "
                f"this one has a free surface; take {type(self.of).__name__}() alone."
            )
        return self.of.eulerian(effects)

    def remaining(self, rates, density, carried):
        share = 1.0 / density  # of the volume, particles being of one mass
        mean = jnp.vdot(share, rates[:, 0]) / jnp.sum(share)
        return self.of.remaining(rates.at[:, 0].add(-mean), density, carried)
