"""From quasi-Lagrangian to Eulerian rates: field advection, as an effect to subtract."""

from __future__ import annotations

import abc
from dataclasses import dataclass

from jaxsph import Mirrored, Otherwise, PairTerm
from jaxsph.at_ghosts import mirrored
from jaxsph.effects import Effect, ShiftingTransport
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

    def rates(self, context, fields, sums):
        divergence = sums["velocity_divergence"]
        return {
            "density": fields["density"] * divergence - sums["mass_flux"],
            "velocity": fields["velocity"] * divergence[:, None] - sums["momentum_flux"],
        }


def acts_on_ghosts(effect: Effect) -> bool:
    """Whether an effect gives the ghosts at walls their values, or has a part in these."""
    given = type(effect)
    return (given.ghost_fields, given.ghost_terms) != (Effect.ghost_fields, Effect.ghost_terms)


def advection_alone(effects: tuple[Effect, ...]) -> tuple[Effect, ...]:
    """The advection of fields, at walls with the ghosts' values and the forces they know of; these
    are constant at particles that are held."""
    return (FieldAdvection(), *filter(acts_on_ghosts, effects))


@dataclass(frozen=True)
class Advection(abc.ABC):
    """How the Eulerian functional f-bar follows from a scene's effects."""

    name = ""

    @abc.abstractmethod
    def eulerian(self, effects: tuple[Effect, ...]) -> tuple[Effect, ...]:
        """The effects of f-bar."""


@dataclass(frozen=True)
class PaperAdvection(Advection):
    """Advection by u alone is subtracted, as printed; the shift-velocity terms stay."""

    name = "paper"

    def eulerian(self, effects):
        return (*effects, FieldAdvection())


@dataclass(frozen=True)
class ConsistentAdvection(Advection):
    """Advection by u + du is subtracted: the shift-velocity terms cancel and are not computed.

    (In the momentum equation up to the factor rho0 / rho_i, below a percent.)
    """

    name = "consistent"

    def eulerian(self, effects):
        kept = tuple(e for e in effects if not isinstance(e, ShiftingTransport))
        return (*kept, FieldAdvection())
